//! Which elements the triangles of a surface are.

/// Elements by their triangles.
#[derive(Debug, Default)]
pub struct Elements {
    /// Per triangle, the tag of its element, and its number among all elements of the file, from 0.
    of_triangles: Vec<(u64, u64)>,
    /// Elements so far.
    count: u64,
    /// The triangles in the order of their tags, where that is not theirs.
    by_tag: Vec<u32>,
}

impl Elements {
    /// Passes over elements that give no triangles.
    pub fn skip(&mut self, count: u64) {
        self.count = self.count.saturating_add(count);
    }

    /// Adds an element with this tag: all triangles from the last that has one up to `end` are its.
    pub fn add(&mut self, tag: u64, end: usize) {
        self.of_triangles.resize(end, (tag, self.count));
        self.skip(1);
    }

    /// No more elements come: they are sorted by their tags.
    pub fn sort(&mut self) {
        if !self.of_triangles.is_sorted_by_key(|(tag, _)| *tag) {
            self.by_tag = (0..self.of_triangles.len() as u32).collect();
            self.by_tag.sort_by_key(|triangle| self.of_triangles[*triangle as usize].0);
        }
    }

    /// How many triangles there are.
    pub fn triangles(&self) -> usize {
        self.of_triangles.len()
    }

    /// The triangles of the elements with a tag, after [`Self::sort`].
    pub fn of_tag(&self, tag: u64) -> impl Iterator<Item = usize> {
        let [begin, end] = [tag, tag.saturating_add(1)].map(|tag| self.before(tag));
        (begin..end).map(|place| self.at(place))
    }

    /// How many triangles have a lower tag.
    fn before(&self, tag: u64) -> usize {
        if self.by_tag.is_empty() {
            return self.of_triangles.partition_point(|(other, _)| *other < tag);
        }
        self.by_tag.partition_point(|triangle| self.of_triangles[*triangle as usize].0 < tag)
    }

    /// The triangle at a place in the order of tags.
    fn at(&self, place: usize) -> usize {
        self.by_tag.get(place).map_or(place, |triangle| *triangle as usize)
    }

    /// Per triangle, the number of its element; nothing where no element was cut into several.
    pub fn cut(&self) -> Vec<i64> {
        let numbers = || self.of_triangles.iter().map(|(_, number)| *number);
        let are_cut = numbers().zip(numbers().skip(1)).any(|(one, next)| one == next);
        let number = |number| i64::try_from(number).unwrap_or(i64::MAX);
        if are_cut { numbers().map(number).collect() } else { Vec::new() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn elements(tags: &[(u64, usize)]) -> Elements {
        let mut elements = Elements::default();
        elements.skip(3);
        let mut end = 0;
        for (tag, triangles) in tags {
            end += triangles;
            elements.add(*tag, end);
        }
        elements.sort();
        elements
    }

    #[test]
    fn triangles_are_found_by_the_tags_of_their_elements_in_any_order() {
        for tags in [[(4, 1), (5, 2), (9, 1)], [(9, 1), (4, 2), (5, 1)], [(7, 1), (u64::MAX - 1, 2), (7, 1)]] {
            let elements = elements(&tags);
            let each: Vec<u64> = tags.iter().flat_map(|(tag, count)| std::iter::repeat_n(*tag, *count)).collect();
            for tag in [0, 4, 5, 6, 7, 9, u64::MAX - 1, u64::MAX] {
                let expected: Vec<usize> = (0..4).filter(|triangle| each[*triangle] == tag).collect();
                assert_eq!(elements.of_tag(tag).collect::<Vec<_>>(), expected, "{tag} among {tags:?}");
            }
            assert_eq!((elements.cut(), elements.triangles()), (vec![3, 4, 4, 5], 4));
        }
        assert_eq!(elements(&[(4, 1), (4, 1)]).cut(), [0_i64; 0]);
    }
}
