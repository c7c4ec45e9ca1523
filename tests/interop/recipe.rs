//! The README's recipe: a file is dropped, and a mesh by the real Gmsh appears.

use super::{run, script, tools};
use crate::support::{Out, fixture, planish, root};
use planish::after::hooks::{self, Account, Chain, Outcome, Target};
use planish::report::mesh::MeshReport;
use planish::result_files;
use planish::settings::{Hook, Occasion};
use planish::settings::{RawCommand, RawSettings};
use std::path::Path;

/// The settings file of the README's section "Drop a file, get a mesh".
pub fn settings_file() -> String {
    let readme = std::fs::read_to_string(root().join("README.md")).expect("committed");
    let (_, section) = readme.split_once("\n## Drop a file, get a mesh\n").expect("the section");
    let (_, block) = section.split_once("\n```toml\n").expect("a block of settings");
    block.split_once("\n```\n").expect("its end").0.to_owned() + "\n"
}

/// The hook with the programs of the environment on its PATH.
fn with_tools(hook: &Hook) -> Hook {
    let RawCommand { command, time_limit } = hook.configured().clone();
    let path = format!("PATH={}", tools().to_str().expect("UTF-8"));
    let command = ["env".to_owned(), path].into_iter().chain(command).collect();
    Hook::new(RawCommand { command, time_limit }, Occasion::Certified).expect("valid")
}

/// Runs all commands to their end.
pub(super) fn ran(hooks: &[Hook], target: &Target, out: &Out) -> Account {
    match hooks::run(hooks, target, out.path(), &|| true).expect("the system helps") {
        Chain::Over(account) => account,
        other => panic!("an account is expected: {other:?}"),
    }
}

/// A certified result, and its target.
fn result(out: &Out) -> Target {
    assert_eq!(out.run(&[&fixture("disk_with_holes.stl")], &["-q"]).code, Some(0));
    Target::new(&fixture("disk_with_holes.stl"), &out.of("disk_with_holes.stl")).expect("paths")
}

fn files(folder: &Path) -> Vec<String> {
    let name = |e: std::fs::DirEntry| e.file_name().to_string_lossy().into_owned();
    let mut names: Vec<String> = std::fs::read_dir(folder).expect("a folder").flatten().map(name).collect();
    names.sort();
    names
}

fn assert_proven(target: &Target) {
    let checked = planish(["check".as_ref(), target.folder().as_os_str()]);
    assert_eq!(checked.code, Some(0), "{}", checked.err);
}

#[test]
fn the_recipe_makes_a_mesh_and_nothing_else() {
    let out = Out::new();
    let target = result(&out);
    let before = files(target.folder());
    let said: RawSettings = toml::from_str(&settings_file()).expect("valid");
    let recipe: Vec<Hook> = said.check().expect("in range").on_certified.iter().map(with_tools).collect();
    let account = ran(&recipe, &target, &out);
    assert_eq!(account.failure(), None);
    let mut after: Vec<String> = files(target.folder());
    after.retain(|f| !before.contains(f));
    assert_eq!(after, ["hooks.json", "mesh.json", "remeshed.msh"]);
    let found = std::fs::read(target.folder().join("mesh.json")).expect("there");
    let found: MeshReport = serde_json::from_slice(&found).expect("a report");
    assert!(found.faithful && found.fine && found.by_charts, "{found:?}");
    let schema = root().join("docs/mesh.schema.json");
    run(script("validate_schema.py").arg(schema).arg(target.folder().join("mesh.json")), "mesh.json breaks its schema");
    let mesh = std::fs::read_to_string(target.folder().join("remeshed.msh")).expect("text");
    assert!(mesh.starts_with("$MeshFormat\n4.1 ") && mesh.contains("\n$Elements\n"), "no mesh of Gmsh's");
    assert!(!hooks::are_due(&recipe, &target));
    assert_proven(&target);
}

#[test]
fn a_mesh_that_is_not_faithful_is_told() {
    let out = Out::new();
    let target = result(&out);
    let said: RawSettings = toml::from_str(&settings_file()).expect("valid");
    let mut recipe: Vec<Hook> = said.check().expect("in range").on_certified.iter().map(with_tools).collect();
    // In the place of the mesher, one that makes a single triangle.
    let lose = "printf 'v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n' > \"$1\"/remeshed.obj";
    let command = ["sh", "-c", lose, "sh", "{folder}"].map(str::to_owned).into();
    recipe[0] = Hook::new(RawCommand { command, time_limit: 60.0 }, Occasion::Certified).expect("valid");
    let RawCommand { command, time_limit } = recipe[1].configured().clone();
    let command = command.iter().map(|part| part.replace("remeshed.msh", "remeshed.obj")).collect();
    recipe[1] = Hook::new(RawCommand { command, time_limit }, Occasion::Certified).expect("valid");
    let account = ran(&recipe, &target, &out);
    assert!(account.failure().is_some(), "{account:?}");
    let outcomes: Vec<Outcome> = account.commands.iter().map(|c| c.outcome).collect();
    assert_eq!(outcomes, [Outcome::Succeeded, Outcome::Failed]);
    let text = std::fs::read_to_string(target.folder().join(result_files::HOOKS)).expect("written");
    assert!(text.contains("not faithful"), "{text}");
    assert_proven(&target);
}

#[test]
fn accounts_follow_the_published_schema_and_leave_the_proof_alone() {
    let out = Out::new();
    let target = result(&out);
    let sh = |script: &str, time_limit| {
        let command = ["sh", "-c", script].map(str::to_owned).into();
        Hook::new(RawCommand { command, time_limit }, Occasion::Certified).expect("valid")
    };
    let missing =
        Hook::new(RawCommand { command: vec!["no-such-program".to_owned()], time_limit: 60.0 }, Occasion::Certified)
            .expect("valid");
    let cases = [
        (vec![sh("echo made > made; yes | head -c 100000", 60.0)], Outcome::Succeeded),
        (vec![sh("exit 3", 60.0), sh("true", 60.0)], Outcome::Failed),
        (vec![sh("kill -9 $$", 60.0)], Outcome::Failed),
        (vec![sh("sleep 1000", 0.1)], Outcome::TimedOut),
        (vec![missing], Outcome::NotStarted),
    ];
    for (commands, outcome) in cases {
        assert!(hooks::are_due(&commands, &target));
        let account = ran(&commands, &target, &out);
        assert_eq!(account.commands[0].outcome, outcome);
        let schema = root().join("docs/hooks.schema.json");
        let written = target.folder().join(result_files::HOOKS);
        run(script("validate_schema.py").arg(schema).arg(written), "hooks.json breaks its schema");
    }
    assert_proven(&target);
    let again = out.run(&[&fixture("disk_with_holes.stl")], &[]);
    assert!(again.out.contains("up to date"), "{}", again.out);
}
