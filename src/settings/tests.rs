use super::*;

#[test]
fn flags_win_over_the_file_and_the_file_over_defaults() {
    let file: RawSettings = toml::from_str("order = 1\nweld = 1e-5\nlog = \"json\"").expect("valid");
    let flags = RawSettings { weld: Some(0.0), ..RawSettings::default() };
    let settings = flags.or(file).check().expect("in range");
    assert_eq!((settings.order, settings.weld, settings.log), (Order::Linear, 0.0, Log::Json));
    assert_eq!(RawSettings::default().check().expect("defaults").weld, 1e-6);
}

#[test]
fn wrong_values_are_refused() {
    assert!(matches!(RawSettings { order: Some(3), ..RawSettings::default() }.check(), Err(SettingsError::Order(3))));
    for weld in [-1e-9, 0.02, f64::NAN] {
        assert!(matches!(
            RawSettings { weld: Some(weld), ..RawSettings::default() }.check(),
            Err(SettingsError::Weld(_))
        ));
    }
    for size in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        assert!(matches!(
            RawSettings { size: Some(size), ..RawSettings::default() }.check(),
            Err(SettingsError::Size(_))
        ));
    }
    for angle in [0.0, 180.0, f64::NAN] {
        let said = RawSettings { feature_angle: Some(FeatureAngle::Degrees(angle)), ..RawSettings::default() };
        assert!(matches!(said.check(), Err(SettingsError::FeatureAngle(_))));
    }
    for days in [0.0, -1.0, 1e9, f64::NAN] {
        let said = RawSettings { keep_results: Some(days), ..RawSettings::default() };
        assert!(matches!(said.check(), Err(SettingsError::KeepResults(_))));
    }
    for ratio in [9.0, f64::NAN, f64::INFINITY] {
        let said = RawSettings { max_area_ratio: Some(ratio), ..RawSettings::default() };
        assert!(matches!(said.check(), Err(SettingsError::AreaRatio(_))));
    }
    let none = RawSettings { max_triangles: Some(0), ..RawSettings::default() };
    assert!(matches!(none.check(), Err(SettingsError::Triangles)));
    assert!(toml::from_str::<RawSettings>("oder = 1").is_err(), "unknown keys are errors");
    let off: RawSettings = toml::from_str("feature-angle = \"off\"\nstrict-disks = true").expect("valid");
    let off = off.check().expect("in range");
    assert_eq!((off.feature_angle, off.strict_disks), (None, true));
    let sharp: RawSettings = toml::from_str("feature-angle = 60").expect("valid");
    assert_eq!(sharp.check().expect("in range").feature_angle, Some(60.0));
    assert!(toml::from_str::<RawSettings>("feature-angle = \"of\"").is_err());
    let file: RawSettings = toml::from_str("hand-off = \"none\"\nsize = 0.5").expect("valid");
    assert_eq!((file.hand_off, file.size), (Some(ExportTarget::None), Some(0.5)));
}

#[test]
fn commands_are_said_in_the_file_and_checked_at_once() {
    let read = |text: &str| toml::from_str::<RawSettings>(text);
    let said = read(
        "order = 1\n[[on_certified]]\ncommand = [\"gmsh\", \"{remesh}\"]\ntime-limit = 60\n\
         [[on_certified]]\ncommand = [\"a\"]\n",
    );
    let settings = RawSettings::default().or(said.expect("valid")).check().expect("in range");
    let limits: Vec<f64> = settings.on_certified.iter().map(|h| h.configured().time_limit).collect();
    assert_eq!(limits, [60.0, 600.0]);
    for wrong in ["command = \"gmsh\"", "command = [1]", "time-limit = 1", "command = [\"a\"]\ntime_limit = 1"] {
        assert!(read(&format!("[[on_certified]]\n{wrong}")).is_err(), "{wrong}");
    }
    let refused = [
        ("command = []", "names no program"),
        ("command = [\"\", \"a\"]", "names no program"),
        ("command = [\"a\", \"{foldr}\"]", "part 2 (\"{foldr}\"): {foldr} is no placeholder; there are {input}"),
        ("command = [\"a\", \"b\", \"{folder\"]", "part 3 (\"{folder\"): the brace at character 1 has no partner"),
        ("command = [\"./a.sh\"]", "relative path \"./a.sh\"; give the full path"),
        ("command = [\"a\"]\ntime-limit = 0", "time-limit is 0; it must be"),
        ("command = [\"a\"]\ntime-limit = -1.5", "time-limit is -1.5"),
        ("command = [\"a\"]\ntime-limit = inf", "time-limit is inf"),
        ("command = [\"a\"]\ntime-limit = nan", "time-limit is NaN"),
    ];
    for (text, expected) in refused {
        let said = read(&format!("[[on_certified]]\ncommand = [\"first\"]\n[[on_certified]]\n{text}"));
        let told = said.expect("well-formed").check().expect_err(text).to_string();
        assert!(told.starts_with("[[on_certified]], table 2: ") && told.contains(expected), "{told}");
    }
    let refused = read("[[on_refused]]\ncommand = [\"mail\", \"{code}\", \"{input}\"]").expect("well-formed");
    assert_eq!(refused.check().expect("in range").on_refused.len(), 1);
    let wrong = read("[[on_refused]]\ncommand = [\"gmsh\", \"{remesh}\"]").expect("well-formed");
    let told = wrong.check().expect_err("there is no such file").to_string();
    assert!(told.starts_with("[[on_refused]], table 1: command, part 2 (\"{remesh}\"): "), "{told}");
}

#[test]
fn commands_run_beside_each_other_even_where_there_is_one_processor() {
    let commands = |text: &str| toml::from_str::<RawSettings>(text).expect("valid").check().map(|s| s.commands).ok();
    assert_eq!(["jobs = 1", "jobs = 3", "jobs = 1024"].map(commands), [Some(4), Some(6), Some(2048)]);
    assert_eq!(["jobs = 3\ncommands = 1", "commands = 0", "commands = 2049"].map(commands), [Some(1), None, None]);
}

#[test]
fn refused_inputs_are_never_deleted() {
    let read = |text: &str| toml::from_str::<RawSettings>(text);
    let moved = read("refused = \"move:bad\"").expect("valid").check().expect("in range").refused;
    assert_eq!(moved, Inputs::Move("bad".into()));
    for wrong in ["delete", "move:", "bad"] {
        let told = read(&format!("refused = \"{wrong}\"")).expect_err(wrong).to_string();
        assert!(told.contains("is none of keep and move:DIR"), "{told}");
    }
}
