//! The names of parts: groups (`g`), objects (`o`) and materials (`usemtl`). Each holds for the faces that follow it.

use super::statements::Part;
use crate::formats::labels::{self, LabelError, Labels};
use crate::settings::LabelSource;

/// The ways to name parts. Where several tell parts apart, groups do before materials, and these before objects: modellers make
/// an object of all, and groups of what they mean to tell apart.
const WAYS: [(&str, Part); 3] = [("group", Part::Group), ("material", Part::Material), ("object", Part::Object)];

/// Names of one way, in the order of the file, each with the number of the first face that has it.
type Runs = Vec<(String, usize)>;

/// The names of the parts of a file.
#[derive(Default)]
pub struct Parts {
    /// For each of [`WAYS`].
    runs: [Runs; 3],
    faces: usize,
}

impl Parts {
    /// The faces that follow are part of this one.
    pub fn begin(&mut self, part: Part, name: String) {
        for (runs, (_, way)) in self.runs.iter_mut().zip(WAYS) {
            if way == part {
                // No face has the name before, if none came in between.
                runs.pop_if(|(_, first)| *first == self.faces);
                runs.push((name, self.faces));
                return;
            }
        }
    }

    /// A face follows.
    pub fn face(&mut self) {
        self.faces += 1;
    }

    /// The names of objects and groups.
    pub fn names(&self) -> impl Iterator<Item = &str> {
        let [groups, _, objects] = &self.runs;
        objects.iter().chain(groups).map(|(name, _)| name.as_str())
    }

    /// The labels of faces that are to come, in the order of the file.
    ///
    /// # Errors
    /// [`LabelError::Missing`] where a way is asked for that names nothing.
    pub fn labels(&self, source: &LabelSource) -> Result<FaceLabels<'_>, LabelError> {
        let there =
            || WAYS.iter().zip(&self.runs).filter(|(_, runs)| self.distinct(runs) > 0).map(|((way, _), _)| *way);
        let asked = labels::asked(there(), source)?;
        let way = asked.and_then(|asked| WAYS.iter().position(|(way, _)| *way == asked)).unwrap_or(self.usual());
        Ok(FaceLabels { runs: &self.runs[way], run: 0, face: 0, all: Labels::new(source) })
    }

    /// The way that tells most parts apart: the first one with several names, or else with one.
    fn usual(&self) -> usize {
        let with = |least: usize| self.runs.iter().position(|runs| self.distinct(runs) >= least);
        with(2).or_else(|| with(1)).unwrap_or_default()
    }

    /// How many names faces have, counted up to two; to have none is one, beside others.
    fn distinct(&self, runs: &Runs) -> usize {
        let with_faces = || runs.iter().filter(|(_, first)| *first < self.faces).map(|(name, _)| name.as_str());
        if with_faces().all(str::is_empty) {
            return 0;
        }
        let before = runs.first().filter(|(_, first)| *first > 0).map(|_| "");
        let mut all = before.into_iter().chain(with_faces());
        let first = all.next();
        1 + usize::from(all.any(|name| Some(name) != first))
    }
}

/// Labels of faces, one after the other.
pub struct FaceLabels<'p> {
    runs: &'p Runs,
    /// The first of the runs that has not begun.
    run: usize,
    face: usize,
    pub all: Labels,
}

impl FaceLabels<'_> {
    /// The triangles of the next face end here.
    pub fn face(&mut self, triangles: usize) {
        while self.runs.get(self.run).is_some_and(|(_, first)| *first <= self.face) {
            self.run += 1;
        }
        let name = self.run.checked_sub(1).map_or("", |run| self.runs[run].0.as_str());
        let label = self.all.named(name);
        self.all.fill(triangles, label);
        self.face += 1;
    }
}

#[cfg(test)]
mod tests {
    use crate::formats::{Format, LabelSource, Limits, Source};

    const POINTS: &str = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n";

    /// The names of all triangles.
    fn names(faces: &str, labels: &LabelSource) -> Result<Vec<String>, String> {
        let (file, limits) = (format!("{POINTS}{faces}"), Limits::default());
        let content = crate::formats::read(Format::Obj, &Source { labels, ..Source::alone(file.as_bytes(), &limits) });
        let content = content.map_err(|error| error.to_string())?;
        Ok(content.soup.labels().iter().map(|label| content.notes.labels[*label as usize].name.clone()).collect())
    }

    #[test]
    fn groups_name_faces_before_materials_and_objects() {
        let usual = |faces: &str| names(faces, &LabelSource::Usual).expect("a surface");
        let file = "o all\nf 1 2 3\ng unused\ng the wall\nusemtl steel\nf 1 2 3 4\ng\nusemtl glass\nf 1 3 4\n";
        assert_eq!(usual(file), ["unnamed", "the wall", "the wall", "unnamed"]);
        let two = file.replace("g\n", "g roof\n");
        assert_eq!(usual(&two), ["unnamed", "the wall", "the wall", "roof"]);
        assert_eq!(usual(&file.replace("g ", "# ")), ["unnamed", "steel", "steel", "glass"]);
        assert_eq!(usual("o all\nf 1 2 3\nf 1 3 4\n"), ["all", "all"]);
        assert_eq!(usual("f 1 2 3\ng after\n"), [""; 0]);
        let material = LabelSource::Array("material".to_owned());
        assert_eq!(names(&two, &material).expect("materials"), ["unnamed", "steel", "steel", "glass"]);
        assert_eq!(names(&two, &LabelSource::Ignored).expect("a surface"), [""; 0]);
        let missing = names("g a\nf 1 2 3\n", &material).expect_err("no materials");
        assert!(missing.contains("nothing called material") && missing.contains("there are group"), "{missing}");
    }
}
