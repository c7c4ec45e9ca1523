//! The command line.

use crate::settings::{FeatureAngle, HandOff, Log, Said, Settings, SettingsError};
use clap::{ArgAction, Args, Parser, Subcommand};
use std::path::PathBuf;

/// Turns poor surface triangulations into certified one-to-one quadratic maps.
///
/// Exit codes: 0 all certified; 1 at least one input refused or failed (the others are done all the same);
/// 2 wrong usage.
#[derive(Debug, Parser)]
#[command(name = "planish", version, max_term_width = 100)]
pub struct Cli {
    /// What to do.
    #[command(subcommand)]
    pub verb: Verb,
}

/// The verbs.
#[derive(Debug, Subcommand)]
pub enum Verb {
    /// Process files, once
    Run(Run),
    /// Re-prove certificates from the files on disk, trusting nothing else
    Check(Check),
    /// Tell what a surface is: topology, defects
    Info(Info),
}

/// `planish run`
#[derive(Debug, Args)]
pub struct Run {
    /// Files (.stl, .obj), or folders of them
    #[arg(required = true, value_name = "INPUT")]
    pub inputs: Vec<PathBuf>,
    /// Folder for the results: one folder per input, named like it
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// Order of the elements: 1 (linear) or 2 (quadratic) [default: 2]
    #[arg(long, value_name = "1|2")]
    pub order: Option<u8>,
    /// Meshers to which results are handed: gmsh writes atlas.msh and remesh.geo [default: gmsh]
    #[arg(long, value_enum, value_name = "MESHER")]
    pub hand_off: Option<HandOff>,
    /// Edge length of the mesh to be made, in the unit of the input [default: that of as many equilateral triangles
    /// of the same area, but at most 1/50 of the bounding box's diagonal]
    #[arg(long, value_name = "H")]
    pub size: Option<f64>,
    /// Edges with a dihedral angle above DEG degrees are features, along which charts end; off: none are [default: 40]
    #[arg(long, value_name = "DEG|off")]
    pub feature_angle: Option<FeatureAngle>,
    /// Let holes of charts be holes of the surface only
    #[arg(long)]
    pub strict_disks: bool,
    /// Split charts in which the area scale varies by more than a factor R [default: 1e6]
    #[arg(long, value_name = "R")]
    pub max_area_ratio: Option<f64>,
    /// Let no chart have more than N triangles [default: any number]
    #[arg(long, value_name = "N")]
    pub max_triangles: Option<usize>,
    /// Process inputs whose output is up to date, too
    #[arg(long)]
    pub force: bool,
    /// Shared options
    #[command(flatten)]
    pub reading: Reading,
    /// Shared options
    #[command(flatten)]
    pub common: Common,
}

/// `planish check`
#[derive(Debug, Args)]
pub struct Check {
    /// Output folders of inputs, or their report.json
    #[arg(required = true, value_name = "DIR|report.json")]
    pub results: Vec<PathBuf>,
    /// Shared options
    #[command(flatten)]
    pub common: Common,
}

/// `planish info`
#[derive(Debug, Args)]
pub struct Info {
    /// Files (.stl, .obj), or folders of them
    #[arg(required = true, value_name = "INPUT")]
    pub inputs: Vec<PathBuf>,
    /// Print JSON: one object per input and line
    #[arg(long)]
    pub json: bool,
    /// Shared options
    #[command(flatten)]
    pub reading: Reading,
    /// Shared options
    #[command(flatten)]
    pub common: Common,
}

/// Options of the verbs that read meshes.
#[derive(Debug, Default, Args)]
pub struct Reading {
    /// Close cracks narrower than REL times the bounding box's diagonal [default: 1e-6]
    #[arg(long, value_name = "REL")]
    pub weld: Option<f64>,
}

/// Options of all verbs.
#[derive(Debug, Default, Args)]
pub struct Common {
    /// Settings file with the same names as the long options; options win
    #[arg(long, value_name = "planish.toml")]
    pub config: Option<PathBuf>,
    /// Form of log messages (on standard error) [default: text]
    #[arg(long, value_enum)]
    pub log: Option<Log>,
    /// Log more: -v informs, -vv explains, -vvv traces
    #[arg(short, long, action = ArgAction::Count)]
    pub verbose: u8,
    /// Print nothing but errors
    #[arg(short, long)]
    pub quiet: bool,
}

impl Verb {
    /// The settings for this verb: options over settings file over defaults.
    ///
    /// # Errors
    /// [`SettingsError`]: wrong usage.
    pub fn settings(&self) -> Result<Settings, SettingsError> {
        let (common, mut said) = match self {
            Self::Run(run) => {
                let said = Said {
                    out: run.out.clone(),
                    order: run.order,
                    weld: run.reading.weld,
                    feature_angle: run.feature_angle,
                    strict_disks: run.strict_disks.then_some(true),
                    max_area_ratio: run.max_area_ratio,
                    max_triangles: run.max_triangles,
                    hand_off: run.hand_off,
                    size: run.size,
                    force: run.force.then_some(true),
                    ..Said::default()
                };
                (&run.common, said)
            }
            Self::Check(check) => (&check.common, Said::default()),
            Self::Info(info) => (&info.common, Said { weld: info.reading.weld, ..Said::default() }),
        };
        said.log = common.log;
        said.verbose = (common.verbose > 0).then_some(common.verbose);
        said.quiet = common.quiet.then_some(true);
        let file = common.config.as_deref().map(Said::from_file).transpose()?;
        said.or(file.unwrap_or_default()).check()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::CommandFactory;

    #[test]
    fn the_command_line_is_consistent() {
        Cli::command().debug_assert();
    }

    #[test]
    fn options_become_settings() {
        let cli = Cli::try_parse_from(["planish", "run", "a.stl", "--out", "o", "--order", "1", "--weld", "0", "-vv"]);
        let settings = cli.expect("valid").verb.settings().expect("in range");
        assert_eq!((settings.weld, settings.verbose), (0.0, 2));
        assert!(Cli::try_parse_from(["planish", "run", "--out", "o"]).is_err(), "an input is needed");
        assert!(Cli::try_parse_from(["planish", "run", "a.stl", "--oder", "1"]).is_err());
    }
}
