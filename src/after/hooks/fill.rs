//! Arguments for one result: paths in the place of placeholders, as the system knows them.

use super::Target;
use crate::result_files;
use crate::settings::{Part, Placeholder, Template};
use std::ffi::OsString;

/// The argument for one result.
pub(super) fn fill(argument: &Template, target: &Target) -> OsString {
    let mut filled = OsString::new();
    for part in argument.parts() {
        match part {
            Part::Text(text) => filled.push(text),
            Part::Placeholder(placeholder) => filled.push(value(*placeholder, target)),
        }
    }
    filled
}

fn value(placeholder: Placeholder, target: &Target) -> OsString {
    let file = |name: &str| target.folder().join(name).into();
    match placeholder {
        Placeholder::Input => target.input().into(),
        Placeholder::Name => target.input().file_name().unwrap_or_default().to_owned(),
        Placeholder::Folder => target.folder().into(),
        Placeholder::Code => target.code().into(),
        Placeholder::Report => file(result_files::REPORT),
        Placeholder::Surface => file(result_files::SURFACE),
        Placeholder::Param => file(result_files::PARAM),
        Placeholder::Seams => file(result_files::SEAMS),
        Placeholder::Atlas => file(result_files::ATLAS_MSH),
        Placeholder::Remesh => file(result_files::REMESH),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::settings::Occasion;
    use std::path::Path;

    fn filled(said: &str, input: &Path, folder: &Path) -> OsString {
        filled_where(Occasion::Certified, said, input, folder)
    }

    fn filled_where(occasion: Occasion, said: &str, input: &Path, folder: &Path) -> OsString {
        let target = Target::new(input, folder).expect("paths").with_code("malformed".to_owned());
        fill(&Template::parse(said, occasion).expect("valid"), &target)
    }

    #[test]
    fn placeholders_become_paths() {
        let table = [
            ("{input}", "/in/a {b}.stl"),
            ("{name}", "a {b}.stl"),
            ("{folder}", "/out/a {b}.stl"),
            ("{report}", "/out/a {b}.stl/report.json"),
            ("{surface}", "/out/a {b}.stl/surface.vtu"),
            ("{param}", "/out/a {b}.stl/param.vtu"),
            ("{seams}", "/out/a {b}.stl/seams.vtp"),
            ("{atlas}", "/out/a {b}.stl/atlas.msh"),
            ("{remesh}", "/out/a {b}.stl/remesh.geo"),
            ("-o={folder}/{name}.msh", "-o=/out/a {b}.stl/a {b}.stl.msh"),
            ("{{name}}", "{name}"),
            ("{{{name}}}", "{a {b}.stl}"),
            ("$HOME; `x` ü", "$HOME; `x` ü"),
            ("", ""),
        ];
        for (said, expected) in table {
            assert_eq!(filled(said, "/in/a {b}.stl".as_ref(), "/out/a {b}.stl".as_ref()), expected, "{said}");
        }
    }

    #[test]
    fn names_that_are_no_utf8_pass_unharmed() {
        use std::os::unix::ffi::{OsStrExt, OsStringExt};
        let name = OsString::from_vec(b"/in/\xff\xfe.stl".to_vec());
        let found = filled("x{name}y{input}", name.as_ref(), "/out".as_ref());
        assert_eq!(found.as_bytes(), b"x\xff\xfe.stly/in/\xff\xfe.stl");
    }

    #[test]
    fn refused_inputs_have_a_code_and_a_report() {
        let filled = |said| filled_where(Occasion::Refused, said, "/in/a.stl".as_ref(), "/out/a.stl".as_ref());
        assert_eq!(filled("{code} {name} {input}"), "malformed a.stl /in/a.stl");
        assert_eq!(filled("{folder} {report}"), "/out/a.stl /out/a.stl/report.json");
    }
}
