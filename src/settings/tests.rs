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
    assert_eq!((file.hand_off.map(|to| to.to_string()), file.size), (Some("none".to_owned()), Some(0.5)));
}

/// The text of planish.toml, and the refusal that it leads to; none where it is in range.
fn refusal(text: &str) -> Option<String> {
    let said: RawSettings = toml::from_str(text).unwrap_or_else(|e| panic!("{text}: {e}"));
    said.check().err().map(|error| error.to_string())
}

#[test]
fn sizes_of_the_mesh_are_checked() {
    let fine = [
        "size-curvature = 3\nsize-min = 1e-9\nsize = 1e-9\ngradation = 0.01\ndeviation = 1e-300\nmesh-order = 1",
        "size-curvature = 10000\nsize-min = 5\ngradation = 10\ndeviation = 1e300\nmesh-order = 2\nsize-from = \"h\"",
    ];
    assert_eq!(fine.map(refusal), [None, None]);
    let wrong = [
        ("size-curvature", &["2.9", "10001", "-8", "nan", "inf"][..], "it must lie between 3 and 10000"),
        ("size-min", &["0", "-1", "nan", "inf", "1e-320"], "it must be a positive number: the least edge length"),
        ("gradation", &["0", "0.009", "11", "-0.4", "nan"], "it must lie between 0.01 and 10"),
        ("deviation", &["0", "-1", "nan", "inf", "1e-320"], "it must be a positive number: a distance"),
        ("mesh-order", &["0", "3"], "it must be 1 (straight triangles) or 2"),
    ];
    for (setting, values, told) in wrong {
        for value in values {
            let value = if setting == "mesh-order" || value.contains(['n', '.', 'e']) {
                (*value).to_owned()
            } else {
                format!("{value}.0")
            };
            let refused = refusal(&format!("{setting} = {value}")).unwrap_or_else(|| panic!("{setting} = {value}"));
            assert!(refused.starts_with(&format!("{setting} is ")) && refused.contains(told), "{refused}");
        }
    }
    let crossed = refusal("size-min = 2.0\nsize = 1.0").expect("no edge could be long enough");
    assert!(crossed.starts_with("size-min is 2, and size is 1: give a least edge length"), "{crossed}");
    let defaults = RawSettings::default().check().expect("defaults");
    let Settings { size_curvature, size_min, size_from, gradation, deviation, mesh_order, .. } = defaults;
    assert_eq!(
        (size_curvature, size_min, size_from, gradation, deviation, mesh_order),
        (None, None, None, 0.4, None, 1)
    );
}

#[test]
fn labels_are_asked_for_or_ignored_and_who_says_one_unsays_the_other() {
    let read = |text: &str| toml::from_str::<RawSettings>(text).expect("valid");
    let labels = |said: RawSettings| said.check().map(|settings| settings.labels).map_err(|error| error.to_string());
    let asked = LabelSource::Array("region".to_owned());
    assert_eq!(labels(read("")), Ok(LabelSource::Usual));
    assert_eq!(labels(read("ignore-labels = true")), Ok(LabelSource::Ignored));
    assert_eq!(labels(read("label = \"region\"\nignore-labels = false")), Ok(asked.clone()));
    let both = labels(read("label = \"region\"\nignore-labels = true")).expect_err("both");
    assert!(both.starts_with("label and ignore-labels are both given"), "{both}");
    let said = |flags: &str, file: &str| labels(read(flags).or(read(file)));
    assert_eq!(said("label = \"region\"", "ignore-labels = true"), Ok(asked));
    assert_eq!(said("ignore-labels = true", "label = \"region\""), Ok(LabelSource::Ignored));
}

/// What decides a result is told in its report, and comes back from there.
#[test]
fn settings_of_a_result_come_back_from_its_report() {
    let text = "size-curvature = 30.0\nsize-min = 0.1\nsize-from = \"h\"\ngradation = 0.2\ndeviation = 0.5\nmesh-order = 2\n\
                feature-angle = 50\nalso = [\"obj\"]\n";
    for labels in ["", "label = \"region\"", "ignore-labels = true"] {
        let said: RawSettings = toml::from_str(&format!("{text}{labels}")).expect("valid");
        let settings = said.check().expect("in range");
        let of_result = crate::report::ResultSettings::from(&settings);
        let json = serde_json::to_string(&of_result).expect("JSON");
        let read: crate::report::ResultSettings = serde_json::from_str(&json).expect("the same");
        assert_eq!(read, of_result);
        let defaults = RawSettings::default().check().expect("defaults");
        assert_ne!(crate::report::ResultSettings::from(&defaults), of_result);
        let again = read.applied_to(defaults);
        assert_eq!((again.size_from.as_deref(), &again.labels), (Some("h"), &settings.labels));
        assert_eq!(crate::report::ResultSettings::from(&again), of_result);
    }
}

#[test]
fn files_for_other_programs_are_there_once_and_can_be_unsaid() {
    let read = |text: &str| toml::from_str::<RawSettings>(text);
    let file = read("also = [\"welded\", \"obj\", \"welded\"]").expect("valid");
    assert_eq!(file.clone().check().expect("in range").also, [Also::Obj, Also::Welded]);
    let none = RawSettings { also: Some("none".parse().expect("a word")), ..RawSettings::default() };
    assert_eq!(none.or(file).check().expect("in range").also, []);
    assert_eq!(RawSettings::default().check().expect("defaults").also, []);
    assert!(read("also = [\"stl\"]").is_err() && read("also = \"obj\"").is_err());
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
