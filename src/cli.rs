//! The command line.

use crate::settings::{
    AlsoFiles, Boundary, ExportTargets, FeatureAngle, Inputs, Log, RawSettings, Refine, Refused, Settings,
    SettingsError,
};
use bytesize::ByteSize;
use clap::{ArgAction, Args, Parser, Subcommand};
use std::path::PathBuf;

/// Turns poor surface triangulations into certified one-to-one quadratic maps.
///
/// Exit codes: 0 all certified; 1 at least one input, or a component of one, refused or failed (the others are done all the
/// same); 2 wrong usage.
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
    /// Process every file that is dropped into a folder, until told to stop
    Watch(Watch),
    /// Re-prove certificates from the files on disk, trusting nothing else; or judge a mesh made through the maps
    Check(Check),
    /// Tell what a surface is: topology, defects
    Info(Info),
    /// Carry meshes made in the planes of charts, or a table of points there, onto the surface
    Lift(Lift),
    /// Put the fields of the input on a new mesh of its surface
    Transfer(Transfer),
    /// Tell what a running daemon does: queue, stages and progress, done, refused
    Status(Status),
    /// Have inputs done again whose result is not certified
    Retry(Retry),
    /// Process one input for another planish
    #[command(name = "job", hide = true)]
    Apart(Apart),
}

/// `planish run`
#[derive(Debug, Args)]
pub struct Run {
    /// Files (.stl .obj .ply .gltf .glb .vtk .vtu .vtp .msh .off .mesh), or folders of them
    #[arg(required = true, value_name = "INPUT")]
    pub inputs: Vec<PathBuf>,
    /// Shared options
    #[command(flatten)]
    pub making: Making,
    /// Shared options
    #[command(flatten)]
    pub common: Common,
}

/// `planish watch`
#[derive(Debug, Args)]
pub struct Watch {
    /// Folder into which files (.stl .obj .ply .gltf .glb .vtk .vtu .vtp .msh .off .mesh) are dropped
    #[arg(value_name = "INBOX")]
    pub inbox: PathBuf,
    /// Look at the inbox every second, instead of being told by the system: for network folders
    #[arg(long)]
    pub poll: bool,
    /// Watch sub-folders, too: INBOX/sub/a.stl becomes OUT/sub/a.stl/
    #[arg(long)]
    pub recursive: bool,
    /// When told to stop, finish what waits first
    #[arg(long)]
    pub drain: bool,
    /// What becomes of an input once it is certified and all commands on it have succeeded: keep, move:DIR or delete
    /// [default: keep]
    #[arg(long, value_name = "keep|move:DIR|delete")]
    pub inputs: Option<Inputs>,
    /// What becomes of an input that is refused or failed, once all commands on it have succeeded: keep or move:DIR
    /// [default: keep]
    #[arg(long, value_name = "keep|move:DIR")]
    pub refused: Option<Refused>,
    /// Tell in this file what the daemon does, for the textfile collector of Prometheus' node_exporter
    #[arg(long, value_name = "FILE")]
    pub metrics: Option<PathBuf>,
    /// Take up no input while the disk of the results has less room than this; 0: take all up [default: 64MiB]
    #[arg(long, value_name = "SIZE")]
    pub min_free: Option<ByteSize>,
    /// Remove results that are older than this, and whose input has left the inbox [default: keep them]
    #[arg(long, value_name = "DAYS")]
    pub keep_results: Option<f64>,
    /// Start nothing and write nothing: tell whether settings, commands and folders are as a start needs them
    #[arg(long)]
    pub check_config: bool,
    /// Shared options
    #[command(flatten)]
    pub making: Making,
    /// Shared options
    #[command(flatten)]
    pub common: Common,
}

/// `planish status`
#[derive(Debug, Args)]
pub struct Status {
    /// The output folder of the daemon
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// Print JSON
    #[arg(long)]
    pub json: bool,
    /// Tell whether an operator must act; exit code 1: yes
    #[arg(long)]
    pub health: bool,
    /// With --health: an input that has waited longer than this for its result is a reason to act
    #[arg(long, value_name = "SECONDS", requires = "health", default_value_t = 3600.0)]
    pub max_age: f64,
    /// Shared options
    #[command(flatten)]
    pub common: Common,
}

/// `planish retry`
#[derive(Debug, Args)]
pub struct Retry {
    /// Names of results that are not certified, as `planish status` tells them
    #[arg(required = true, value_name = "NAME")]
    pub names: Vec<PathBuf>,
    /// The output folder of the daemon
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// Shared options
    #[command(flatten)]
    pub common: Common,
}

/// Options of the verbs that make results.
#[derive(Debug, Default, Args)]
pub struct Making {
    /// Folder for the results: one folder per input, named like it
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// Order of the elements: 1 (linear) or 2 (quadratic) [default: 2]
    #[arg(long, value_name = "1|2")]
    pub order: Option<u8>,
    /// Boundary of charts in the plane: natural, the one that a chart has when it is laid out flat, where that is one-to-one
    /// and scales areas evenly, else the circle; or the circle for all [default: natural]
    #[arg(long, value_enum, value_name = "SHAPE")]
    pub boundary: Option<Boundary>,
    /// Bisect triangles where the quadratic map of a chart is too poor, to at most N times as many per chart; off: none are
    /// [default: 4]. The surface does not change, and triangles tell which one of the input they are part of
    #[arg(long, value_name = "N|off")]
    pub refine: Option<Refine>,
    /// Meshers to which results are handed: gmsh writes atlas.msh and remesh.geo; mmg writes mmg/surface.mesh for mmgs and
    /// mmg/chart-NNN.mesh for mmg2d; with a comma between them, or none [default: gmsh]
    #[arg(long, value_name = "gmsh,mmg")]
    pub hand_off: Option<ExportTargets>,
    /// Write these files for other programs, too: obj (surface.obj) and glb (surface.glb), with texture coordinates; welded
    /// (welded.vtu), with one node where charts meet; with commas between them, or none [default: none]
    #[arg(long, value_name = "obj,glb,welded")]
    pub also: Option<AlsoFiles>,
    /// Edge length of the mesh to be made, in the unit of the input [default: that of as many equilateral triangles
    /// of the same area, but at most 1/50 of the bounding box's diagonal]
    #[arg(long, value_name = "H")]
    pub size: Option<f64>,
    /// Shorter edges where the surface bends, so that N make a full turn [default: edges of one length]
    #[arg(long, value_name = "N")]
    pub size_curvature: Option<f64>,
    /// No edges shorter than this, in the unit of the input, whatever bends and narrow places need; the report tells where
    /// they would need shorter ones
    #[arg(long, value_name = "H")]
    pub size_min: Option<f64>,
    /// Edges as long as this array of points says, in the unit of the input: of a VTK file, or the view of that name in an MSH
    /// file; of one component. Shorter ones where narrow places, --size-curvature or --deviation need them; none longer than
    /// --size, which is the largest of these lengths where it is not given
    #[arg(long, value_name = "ARRAY")]
    pub size_from: Option<String>,
    /// Edges become longer by at most G times the distance from shorter ones [default: 0.4]
    #[arg(long, value_name = "G")]
    pub gradation: Option<f64>,
    /// Edges so short that mesh and surface are about D from each other at most, in the unit of the input; `planish check --mesh`
    /// with --deviation D tells whether they are
    #[arg(long, value_name = "D")]
    pub deviation: Option<f64>,
    /// Order of the elements of the mesh: 2 has Gmsh make curved triangles, whose nodes all lie on the surface [default: 1]
    #[arg(long, value_name = "1|2")]
    pub mesh_order: Option<u8>,
    /// Edges with a dihedral angle above DEG degrees, and those above 5/8 of it that continue them, are features, along
    /// which charts end; off: none are [default: 40]. Passed over are creases that part nothing (they run out) or are
    /// short; those around patches too small for a face (unless they are flat), the sooner the blunter they are, and blunt
    /// ones around narrow bevels; and angles that only single triangles have (raw noise: angles are measured over some
    /// triangles on either side), or that rounding of the coordinates may have made
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
    /// Compute this much at once: inputs, or charts of one input [default: the number of processors]
    #[arg(long, value_name = "N")]
    pub jobs: Option<usize>,
    /// Run commands (of the settings file) on this many results at once [default: twice --jobs, but at least 4]
    #[arg(long, value_name = "N")]
    pub commands: Option<usize>,
    /// Memory for inputs on their way and factorisations, as 8GiB or 500M; what needs more alone is done alone [default:
    /// half of the machine's]
    #[arg(long, value_name = "SIZE")]
    pub memory: Option<ByteSize>,
    /// The most memory that one input may take; more ends its process, and it is refused [default: no limit]
    #[arg(long, value_name = "SIZE")]
    pub job_memory: Option<ByteSize>,
    /// The most seconds that one input may take, without its commands; then its process is ended, and it is refused
    /// [default: no limit]
    #[arg(long, value_name = "SECONDS")]
    pub job_time: Option<f64>,
    /// Shared options
    #[command(flatten)]
    pub reading: Reading,
}

/// `planish job`, which planish itself starts
#[derive(Debug, Args)]
pub struct Apart {
    /// The input
    #[arg(value_name = "INPUT")]
    pub input: PathBuf,
    /// The name of its result
    #[arg(long, allow_hyphen_values = true)]
    pub name: PathBuf,
    /// The folder for the files of its result
    #[arg(long)]
    pub into: PathBuf,
    /// The folder out of which no link may lead
    #[arg(long)]
    pub within: Option<PathBuf>,
    /// The mark of the input
    #[arg(long)]
    pub mark: Option<PathBuf>,
    /// Whether it waits for files beside it
    #[arg(long)]
    pub waits: bool,
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
    /// Judge this mesh, made through the maps of the one result: is anything lost or folded, are its elements good? The
    /// certificates are not proven again. What is found is kept as mesh.json in the result folder
    #[arg(long, value_name = "MESH")]
    pub mesh: Option<PathBuf>,
    /// The edge length that the mesher was asked for, in the unit of the input [default: that of remesh.geo]
    #[arg(long, value_name = "H", requires = "mesh")]
    pub size: Option<f64>,
    /// How far nodes may be off the surface, relative to the diagonal of its bounding box: more than rounding for meshes of
    /// programs that do not know the surface, as mmgs
    #[arg(long, value_name = "REL", requires = "mesh", default_value_t = 1e-6)]
    pub off: f64,
    /// The least gamma of a fine element
    #[arg(long, value_name = "G", requires = "mesh", default_value_t = 0.1)]
    pub min_gamma: f64,
    /// Find how far mesh and surface are from each other, inside elements, too, and let nowhere be more than D, in the unit of
    /// the input
    #[arg(long, value_name = "D", requires = "mesh")]
    pub deviation: Option<f64>,
    /// Where it is more, ask for edges half as long: remesh.geo heeds that when Gmsh runs again. Three times at most, and no
    /// edges shorter than --size-min was
    #[arg(long, requires = "deviation")]
    pub finer: bool,
    /// Print what is found of the mesh as JSON
    #[arg(long, requires = "mesh")]
    pub json: bool,
    /// Shared options
    #[command(flatten)]
    pub common: Common,
}

/// `planish lift`
#[derive(Debug, Args)]
pub struct Lift {
    /// Meshes of the planes of charts, which tell their charts: by references (.mesh) or surfaces (.msh) that count from 1, by an
    /// array `chart` (.vtk, .vtu), or by a name like chart-012.stl. Or a table with the columns chart, u and v (.csv)
    #[arg(required = true, value_name = "MESH")]
    pub meshes: Vec<PathBuf>,
    /// The result whose charts these are: its folder, or its report.json
    #[arg(long, value_name = "DIR")]
    pub atlas: PathBuf,
    /// The mesh on the surface (.msh .vtu .stl .mesh .obj), or the table of points in space (.csv)
    #[arg(short, long, value_name = "FILE")]
    pub output: PathBuf,
    /// Order of the elements: 2 gives them nodes in the middle of sides, which lie on the surface (.msh and .vtu) [default: 1]
    #[arg(long, value_name = "1|2", value_parser = clap::value_parser!(u8).range(1..=2))]
    pub mesh_order: Option<u8>,
    /// The mesh is one in space: bring its nodes to the nearest places of the surface
    #[arg(long)]
    pub project: bool,
    /// Shared options
    #[command(flatten)]
    pub common: Common,
}

/// `planish transfer`
#[derive(Debug, Args)]
pub struct Transfer {
    /// The mesh, in space, in any format that planish reads
    #[arg(value_name = "MESH")]
    pub mesh: PathBuf,
    /// The result whose fields these are: its folder, or its report.json
    #[arg(long, value_name = "DIR")]
    pub atlas: PathBuf,
    /// The mesh with fields (.msh, .vtu)
    #[arg(short, long, value_name = "FILE")]
    pub output: PathBuf,
    /// Fields of cells whose sums are to be kept, as charges or counts; others are densities, whose integrals are
    #[arg(long, value_name = "ARRAY", value_delimiter = ',')]
    pub extensive: Vec<String>,
    /// Shared options
    #[command(flatten)]
    pub common: Common,
}

/// `planish info`
#[derive(Debug, Args)]
pub struct Info {
    /// Files (.stl .obj .ply .gltf .glb .vtk .vtu .vtp .msh .off .mesh), or folders of them
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
    /// Close cracks narrower than REL times the bounding box's diagonal, and T-junctions: vertices no farther than that from
    /// an open edge of another side [default: 1e-6]
    #[arg(long, value_name = "REL")]
    pub weld: Option<f64>,
    /// Let this tell the named parts of a surface, the borders of which become seams: a cell array of a VTK file, a face
    /// property of PLY, `group`, `object` or `material` of OBJ, `mesh` or `material` of glTF, `physical` or `elementary` of MSH
    /// [default: solids of STL, groups of OBJ, meshes of glTF, physical groups of MSH, references of MEDIT, and arrays with
    /// usual names such as label, region, group, material]
    #[arg(long, value_name = "ARRAY")]
    pub label: Option<String>,
    /// Let names of parts count for nothing: their borders are no seams
    #[arg(long, conflicts_with = "label")]
    pub ignore_labels: bool,
}

impl Reading {
    fn said(&self) -> RawSettings {
        RawSettings {
            weld: self.weld,
            label: self.label.clone(),
            ignore_labels: self.ignore_labels.then_some(true),
            ..RawSettings::default()
        }
    }
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
            Self::Run(run) => (&run.common, run.making.said()),
            Self::Watch(watch) => (&watch.common, watch.said()),
            Self::Check(check) => (&check.common, RawSettings::default()),
            Self::Info(info) => (&info.common, info.reading.said()),
            Self::Transfer(transfer) => (&transfer.common, RawSettings::default()),
            Self::Lift(lift) => (&lift.common, RawSettings::default()),
            Self::Apart(apart) => (&apart.common, RawSettings { log: Some(Log::Json), ..RawSettings::default() }),
            Self::Retry(retry) => (&retry.common, RawSettings { out: retry.out.clone(), ..RawSettings::default() }),
            Self::Status(status) => (&status.common, RawSettings { out: status.out.clone(), ..RawSettings::default() }),
        };
        said.log = common.log.or(said.log);
        said.verbose = (common.verbose > 0).then_some(common.verbose);
        said.quiet = common.quiet.then_some(true);
        let file = common.config.as_deref().map(RawSettings::from_file).transpose()?;
        said.or(file.unwrap_or_default()).check()
    }
}

impl Watch {
    fn said(&self) -> RawSettings {
        RawSettings {
            poll: self.poll.then_some(true),
            recursive: self.recursive.then_some(true),
            drain: self.drain.then_some(true),
            inputs: self.inputs.clone(),
            refused: self.refused.clone(),
            metrics: self.metrics.clone(),
            min_free: self.min_free,
            keep_results: self.keep_results,
            ..self.making.said()
        }
    }
}

impl Making {
    fn said(&self) -> RawSettings {
        RawSettings {
            out: self.out.clone(),
            order: self.order,
            boundary: self.boundary,
            refine: self.refine,
            feature_angle: self.feature_angle,
            strict_disks: self.strict_disks.then_some(true),
            max_area_ratio: self.max_area_ratio,
            max_triangles: self.max_triangles,
            hand_off: self.hand_off,
            also: self.also.clone(),
            size: self.size,
            size_curvature: self.size_curvature,
            size_min: self.size_min,
            size_from: self.size_from.clone(),
            gradation: self.gradation,
            deviation: self.deviation,
            mesh_order: self.mesh_order,
            force: self.force.then_some(true),
            jobs: self.jobs,
            commands: self.commands,
            memory: self.memory,
            job_memory: self.job_memory,
            job_time: self.job_time,
            ..self.reading.said()
        }
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
