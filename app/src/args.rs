//! The command line, word by word.

use std::{path::PathBuf, time::Duration};

use clap::{
    Args, Parser, Subcommand, ValueEnum,
    builder::{PathBufValueParser, TypedValueParser},
    value_parser,
};
use intrados_light::{Shard, Sides};
use intrados_mechanics::read::Units;
use intrados_scene::{
    AxisRuns,
    attach::{Along, Face, Kind, VoxelType},
    import::KindByName,
    structure::{Course, Date, Electrode},
};
use intrados_transport::{Estimator, Roulette, Steering};
use intrados_xray::scan::Corrections;
use serde::{Deserialize, Serialize};

/// Predicts damage in reinforced-concrete columns, beams and tunnel linings, and shows it.
#[derive(Debug, Parser)]
#[command(name = "intrados", version, propagate_version = true, after_help = AFTER_HELP)]
pub(crate) struct Cli {
    #[command(subcommand)]
    pub(crate) command: Option<Command>,
    #[command(flatten)]
    pub(crate) common: Common,
}

const AFTER_HELP: &str = "\
A SCENE is a .ron scene, a .glb or .gltf model, or the name of a scene that comes with the program (column, beam, tunnel, cornell, room, …).
stdout carries data only; messages and progress go to stderr.

Exit codes: 0 done, 1 internal error or a failed check, 2 wrong usage, 3 target error not reached, 65 bad input, 66 no input,
73 cannot write, 75 a unit of a campaign that is to be started again, 130 interrupted.

Interrupted by Ctrl-C or SIGTERM, render and measure write what they have reached and mark it; predict, scan, analyze and experiment table-3-1
(with --out) keep their finished parts in that folder, killed ones too, and the same command goes on from them: slices, what gauges and surveys say,
and each life once all of it is computed (minutes; a life that is broken off, and photographs, are begun again). What analyze has reached besides is
in the folder `stopped` within it. A second signal ends at once.
The files of a run come to their folder all at once, the JSON that lists them last: a list that is there names files of one run. While such a run
works, another one into the same folder is refused (73).
An option that a run would not use is refused (2).

Examples:
  intrados render column                          a picture of the bundled column
  intrados measure room --target-rel-error 0.002  readings from both sides
  intrados predict column --out report            damage per member";

#[derive(Debug, Default, Args)]
pub(crate) struct Common {
    /// How results are printed
    #[arg(
        long,
        global = true,
        value_enum,
        default_value_t,
        value_name = "FORMAT",
        help_heading = "Output"
    )]
    pub(crate) format: Format,
    /// No progress, no warnings
    #[arg(long, short, global = true, help_heading = "Output")]
    pub(crate) quiet: bool,
    /// More messages; twice for even more
    #[arg(long, short, global = true, action = clap::ArgAction::Count, help_heading = "Output")]
    pub(crate) verbose: u8,
    /// Threads to work with; all cores if absent. The result is the same for any number
    #[arg(long, global = true, value_name = "N", value_parser = value_parser!(u16).range(1..=1024), help_heading = "Output")]
    pub(crate) threads: Option<u16>,
    /// A folder that files may be read from which a scene, model or header names, beside its own
    /// folder and INTRADOS_DATA; may be given several times
    #[arg(long, global = true, value_name = "DIR", value_parser = PathBufValueParser::new().try_map(folder), help_heading = "Input")]
    pub(crate) allow: Vec<PathBuf>,
}

fn folder(path: PathBuf) -> Result<PathBuf, &'static str> {
    if path.is_dir() { Ok(path) } else { Err("there is no such folder") }
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, ValueEnum)]
pub(crate) enum Format {
    #[default]
    Table,
    Json,
}

#[derive(Debug, Subcommand)]
pub(crate) enum Command {
    /// The window (this is also what happens without a command)
    #[command(after_help = "Example:\n  intrados view scenes/column.ron")]
    View(View),
    /// A picture of the window, as somebody would see it once the prediction is done
    #[command(
        after_help = "Examples:\n  intrados screenshot column --member C2 --out window.png\n  xvfb-run -a intrados screenshot bridge.ron --tab Report --size 1600x1000 --theme light --out report.png"
    )]
    Screenshot(Screenshot),
    /// What is in a file: sizes, members, lamps, cameras, meters
    #[command(after_help = "Example:\n  intrados info bridge.glb --format json")]
    Info(Files),
    /// Every problem in a file, with its place
    #[command(after_help = "Example:\n  intrados validate scene.ron model.glb")]
    Validate(Files),
    /// Writes a parametric scene to start from
    #[command(
        after_help = "Examples:\n  intrados new column my_column.ron\n  intrados new tunnel tunnel.glb     the same as a model"
    )]
    New(New),
    /// Makes a project folder of a structure's model: IFC, glTF or OBJ
    #[command(
        after_help = "Examples:\n  intrados import bridge.ifc --year 1974 --exposure \"XC4, XD3\"\n  intrados import tunnel.glb --out tunnel\n\nThe folder holds scene.ron (which every other command takes as it is), the geometry, evidence.ron and a README that says what was assumed by which rule.\nIFC is read by IfcOpenShell: pip install ifcopenshell==0.9.0.post1. INTRADOS_PYTHON names the Python that has it; python3 if unset. An element that takes it longer than 60 s (INTRADOS_IFC_SECONDS) is left out and named."
    )]
    Import(Import),
    /// Puts evidence beside a scene: CT slices, a table (CSV), a load test, or a single finding
    #[command(
        after_help = "Examples:\n  intrados attach bridge P1 half_cell.csv --face front --date 2026-05-03\n  intrados attach bridge B1 --load-test truck --force-kn 100 --along 0.5\n  intrados attach bridge B1 gauges.csv --unit ue --test truck\n  intrados attach bridge P1 core_*.tif --pixel-mm 0.05 --along 0.3 --face front --depth-mm 30 --diameter-mm 100\n  intrados attach bridge P1 --crack 0.3 --course along --along 0.3,0.5 --face front\n\nA table's columns tell what it holds: mV, cover_mm, rebound, velocity_m_s, carbonation_mm, depth_mm with chloride_percent_cement (or chloride_percent_concrete), or gauge with value (and a column unit or --unit); beside these along, face, angle_deg, height_m, date, std_error, test. Gauges have along, face or angle_deg, and depth_mm: one that is not known yet is defined so (ue, m/m: strain along the axis; mm, m: displacement, upwards positive).\nFiles are copied into evidence/ beside the scene, entries written into evidence.ron, which may be edited by hand as well. Nothing is written where anything is wrong."
    )]
    Attach(Box<Attach>),
    /// Takes evidence away again, or lists what is there
    #[command(
        after_help = "Examples:\n  intrados detach bridge --list\n  intrados detach bridge P1 \"crack 1\""
    )]
    Detach(Detach),
    /// Every field of a scene and of its evidence, with unit, default and example: JSON Schema, or a
    /// page to read
    #[command(
        after_help = "Examples:\n  intrados schema > scene.schema.json\n  intrados schema evidence > evidence.schema.json\n  intrados schema --page | less"
    )]
    Schema(Schema),
    /// Renders a picture: PNG, and EXR with variance, samples and orders of reflection
    #[command(
        after_help = "Examples:\n  intrados render column --spp 256 --out pictures\n  intrados render cornell --side both --time-limit 20s"
    )]
    Render(Render),
    /// Reads camera and meters from both sides, with error bars and the duality gap
    #[command(
        after_help = "Example:\n  intrados measure room --target-rel-error 0.002 --format json"
    )]
    Measure(Measure),
    /// Computes stress, creep and damage of members over their load history, or runs an Abaqus or
    /// CalculiX deck or a Gmsh mesh
    #[command(
        after_help = "Examples:\n  intrados analyze column --out stress\n  intrados analyze tunnel --member T1 --element 0.3 --format json\n  intrados analyze beam --member B1 --fine 0.4..0.6 --out stress\n  intrados analyze beam --member B1 --to-failure --out strength\n  intrados analyze bracket.inp --units mm,N --out stress\n  intrados analyze wall.msh --units m,N --groups wall.groups.ron --out stress\n\nWhat the physical groups of a mesh are is said in a file such as\n  (schema: \"intrados.groups/1\",\n   materials: [(group: \"core\", modulus_gpa: 33, poisson: 0.2, density_kg_m3: 2500, expansion_1e6_k: 10)],\n   supports: [(group: \"foot\", x: true, y: true, z: true), (group: \"side\", x: true, moved_mm: (0.5, 0, 0))],\n   loads: [(action: Weight(gravity_m_s2: (0, 0, -9.81))),\n           (group: \"top\", action: Pressure(pressure_kpa: 100)),\n           (group: \"top\", action: Traction(traction_kpa: (20, 0, 0))),\n           (group: \"rim\", action: Force(force_kn: (0, 0, -10))),\n           (group: \"core\", action: Temperature(uniform_k: 15))])\nMaterials, weight and temperature without a group are those of all solids.\n\nWhat it does not do: bars and tendons of glTF members are used only where their nodes say how they run, as those of `intrados import` do (else it is plain concrete, with a warning); members are followed in second order where it counts, and end where loads exceed those of buckling or parts have moved by a twentieth of the length; a Gmsh mesh is of solids, linear elastic, in one step."
    )]
    Analyze(Analyze),
    /// Scans members with X-rays: projections, reconstructed slices, and the truth beside them; or
    /// reconstructs a sinogram
    #[command(
        after_help = "Examples:\n  intrados scan column --member C2 --along 0.35 --out scanned\n  intrados scan --sinogram core.tif --geometry parallel --pixel-mm 0.05 --out slices\n  intrados scan specimens --sinogram views.tif --member P1 --along 0.3 --out slices"
    )]
    Scan(Scan),
    /// Finds pores and cracks in CT slices
    #[command(
        after_help = "Example:\n  intrados detect slices/*.tif --truth masks/*.tif --pixel-mm 0.05 --out found"
    )]
    Detect(Detect),
    /// Finds where photographs were taken from, by corners picked in them, and unrolls the faces
    /// that they show
    #[command(
        after_help = "Examples:\n  intrados photo column --corners C2\n  intrados photo column hall.jpg --pose picks.csv --mm-per-px 0.5 --out maps\n  intrados photo column a.jpg b.jpg --pose picks.csv --relight\n\nThe table of picks has the columns u, v (pixels of the upright photograph from its top left), and either x, y, z (m) or member, corner (as --corners numbers them); of several photographs photo, the file's name. Four picks are needed where the focal length is known (EXIF or --focal-px), else six; more are better, and points out of one plane.\nWritten are pose.json; of each photograph the model's edges drawn over it; of each face that it shows its light as PNG with a world file (m across and along), and where it is unknown in white: not seen, flatter than 10° or outside.\nWith --relight also each face's reflectance (_relit.png, sixteen bits, relative, black where it is unknown) and its standard error (_relit_error.png, 65535 is 100 % or unknown), and of faces that several photographs show the merged map.\nPixels of a whole picture are assumed: one that was cut out needs --focal-px."
    )]
    Photo(Photo),
    /// Predicts the damage of every member, with a report
    #[command(after_help = "Example:\n  intrados predict scenes/column.ron --out report")]
    Predict(Predict),
    /// Runs an experiment that a README or the documentation quotes
    #[command(after_help = "Example:\n  intrados experiment table-3-1 --cases 1..20 --out table")]
    Experiment(Experiment),
    /// Runs the battery of checks: closed forms, walks, sampling
    #[command(after_help = "Example:\n  intrados verify --format json")]
    Verify,
    /// Adds up accumulators of one scene that `--shard` wrote
    #[command(
        after_help = "Example:\n  intrados render column --spp 4096 --shard 0/2 --out parts   (and 1/2 elsewhere)\n  intrados merge parts/*.acc --out whole"
    )]
    Merge(Merge),
    /// Splits work over many structures, or long work on one, into units that any scheduler can run
    #[command(
        subcommand_required = true,
        after_help = "Example:\n  intrados campaign new door64 --command measure --over door --split 64 -- --spp 65536\n  intrados campaign launch door64 --local 2 --submit\n  intrados campaign status door64\n  intrados campaign collect door64\n\nA unit that is done is never done again; one that was stopped (SIGTERM, exit code 75) or killed goes on from its checkpoint when it is started again. The folder is all that workers share. What is collected has the same bits for any number of units and workers and any order."
    )]
    Campaign(Campaign),
}

#[derive(Debug, Args, Default)]
pub(crate) struct View {
    /// What to open
    pub(crate) scene: Option<PathBuf>,
}

// What a picture of the window shows.
#[derive(Debug, Args)]
pub(crate) struct Screenshot {
    /// A scene or a model, or the name of a bundled scene
    pub(crate) scene: PathBuf,
    /// Panel that is in front: Structure, Photos, CT, Stress, Report, Render …
    #[arg(long, value_name = "NAME")]
    pub(crate) tab: Option<String>,
    /// Id or name of the member that is selected
    #[arg(long, value_name = "MEMBER")]
    pub(crate) member: Option<String>,
    /// How the panels lie
    #[arg(long, value_enum, default_value_t = WindowLayout::Inspector)]
    pub(crate) layout: WindowLayout,
    /// Points across and down
    #[arg(long, value_name = "WxH", default_value = "1280x800", value_parser = window_size)]
    pub(crate) size: [u32; 2],
    /// Pixels a point: 2 is what screens of high density have
    #[arg(long, value_name = "X", default_value_t = 1.0, value_parser = window_scale)]
    pub(crate) scale: f32,
    /// Colours of the window
    #[arg(long, value_enum, default_value_t = WindowTheme::Dark)]
    pub(crate) theme: WindowTheme,
    /// What the window speaks
    #[arg(long, value_enum, default_value_t = WindowLanguage::En)]
    pub(crate) language: WindowLanguage,
    /// Longest to wait for the prediction, seconds; then the window is taken as it is
    #[arg(long, value_name = "SECONDS", default_value_t = 300)]
    pub(crate) wait: u64,
    /// PNG that is written
    #[arg(long, short, value_name = "FILE")]
    pub(crate) out: PathBuf,
}

/// See [`Screenshot::layout`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum WindowLayout {
    /// The structure, and a member's sheet
    Inspector,
    /// Estimators, meters, fields and convergence
    Expert,
}

/// See [`Screenshot::theme`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum WindowTheme {
    Light,
    Dark,
}

/// See [`Screenshot::language`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum WindowLanguage {
    /// English
    En,
    /// German
    De,
    /// Chinese
    Zh,
}

fn window_size(text: &str) -> Result<[u32; 2], String> {
    let side = |text: &str| text.parse().ok().filter(|n| (300..=8000).contains(n));
    let sides = text.split_once(['x', '×']);
    sides
        .and_then(|(w, h)| Some([side(w)?, side(h)?]))
        .ok_or_else(|| "give two numbers between 300 and 8000, such as 1280x800".into())
}

fn window_scale(text: &str) -> Result<f32, String> {
    match text.parse::<f32>() {
        Ok(scale) if (0.5..=4.0).contains(&scale) => Ok(scale),
        _ => Err("give a number between 0.5 and 4".into()),
    }
}

#[derive(Debug, Args)]
pub(crate) struct Files {
    /// Scenes, models, or names of bundled scenes
    #[arg(required = true, value_name = "FILE")]
    pub(crate) files: Vec<PathBuf>,
}

/// `intrados schema`.
#[derive(Debug, Args)]
pub(crate) struct Schema {
    /// Of a scene, or of evidence.ron beside it
    #[arg(value_enum, default_value_t)]
    pub(crate) of: SchemaOf,
    /// A page in Markdown instead of JSON Schema, of both
    #[arg(long)]
    pub(crate) page: bool,
}

/// What a schema is of.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, ValueEnum)]
pub(crate) enum SchemaOf {
    #[default]
    Scene,
    Evidence,
}

#[derive(Debug, Args)]
pub(crate) struct New {
    /// What to begin with
    #[arg(value_parser = ["column", "beam", "tunnel"])]
    pub(crate) kind: String,
    /// Where to: .ron, or .glb for a model with bars, stirrups and tendons as nodes; KIND.ron if
    /// absent
    pub(crate) file: Option<PathBuf>,
    /// Replace the file if there is one
    #[arg(long)]
    pub(crate) force: bool,
}

#[derive(Debug, Args)]
pub(crate) struct Import {
    /// What to import: .ifc, .glb, .gltf or .obj
    pub(crate) model: PathBuf,
    /// Folder to make, empty or not there yet; the model's name if absent
    #[arg(long, value_name = "DIR")]
    pub(crate) out: Option<PathBuf>,
    /// Unit of an OBJ file, or of a glTF file that is not in metres as it should be
    #[arg(long, value_name = "UNIT", value_parser = ["mm", "cm", "m", "in", "ft"])]
    pub(crate) unit: Option<String>,
    /// Which axis of an OBJ file points up, or of a glTF file whose y axis does not
    #[arg(long, value_name = "AXIS", value_parser = ["y", "z"])]
    pub(crate) up: Option<String>,
    /// When it was built: concrete of which nothing is said is assumed by that, and age
    #[arg(long, value_name = "YEAR", value_parser = value_parser!(i32).range(1850..=2100))]
    pub(crate) year: Option<i32>,
    /// Classes of EN 206 that attack members of which the model says none, such as "XC4, XD3"
    #[arg(long, value_name = "CLASSES", value_parser = exposure_classes)]
    pub(crate) exposure: Option<String>,
    /// What people, goods and traffic weigh on slabs in the long run, kN/m²; nothing if absent
    #[arg(long, value_name = "KN_M2", value_parser = imposed)]
    pub(crate) imposed: Option<f32>,
    /// What elements of that name (or GlobalId) are: column, beam, slab, wall, footing, lining,
    /// pipe, other, or none; again for others
    #[arg(long = "kind", value_name = "NAME=KIND", value_parser = kind_by_name)]
    pub(crate) kinds: Vec<KindByName>,
}

/// `Überbau=slab`.
fn kind_by_name(text: &str) -> Result<KindByName, String> {
    use intrados_scene::MemberKind as K;
    let (name, kind) = text
        .rsplit_once('=')
        .filter(|(name, _)| !name.trim().is_empty())
        .ok_or("give NAME=KIND, such as \"Deck 1=slab\"")?;
    let kind = match kind.trim() {
        "column" => Some(K::Column),
        "beam" => Some(K::Beam),
        "slab" => Some(K::Slab),
        "wall" => Some(K::Wall),
        "footing" => Some(K::Footing),
        "lining" => Some(K::Lining),
        "pipe" => Some(K::Pipe),
        "other" => Some(K::Other),
        "none" => None,
        other => {
            return Err(format!(
                "{other} is none of column, beam, slab, wall, footing, lining, pipe, other, none"
            ));
        }
    };
    Ok(KindByName { name: name.into(), kind })
}

/// Storage halls carry some tens of kN/m².
fn imposed(text: &str) -> Result<f32, String> {
    let load: f32 = text.parse().map_err(|_| "give a number of kN/m²".to_owned())?;
    if load > 0.0 && load <= 200.0 { Ok(load) } else { Err("give 0 to 200 kN/m²".into()) }
}

/// A set of words that stand for a type of another crate.
macro_rules! words {
    ($(#[$doc:meta])* $name:ident for $to:ty: $($(#[$d:meta])* $word:ident => $value:expr),+ $(,)?) => {
        $(#[$doc])*
        #[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
        pub(crate) enum $name { $($(#[$d])* $word),+ }

        impl From<$name> for $to {
            fn from(word: $name) -> Self {
                match word { $($name::$word => $value),+ }
            }
        }
    };
}

#[derive(Debug, Args)]
pub(crate) struct Attach {
    /// A project's folder, which holds scene.ron, or a scene file
    #[arg(value_name = "FOLDER")]
    pub(crate) project: PathBuf,
    /// Id or name of the member
    pub(crate) member: String,
    /// CT slices or a volume of one core (.tif, .png, .mha, .dcm; others with --raw), one table
    /// (.csv, .tsv, .txt), or with --pose one photograph (.jpg, .png, .tif)
    #[arg(value_name = "FILE", conflicts_with = "finding", required_unless_present = "finding")]
    pub(crate) files: Vec<PathBuf>,
    /// Name, unique within the member; made of its kind or file if absent
    #[arg(long, value_name = "NAME")]
    pub(crate) name: Option<String>,
    #[command(flatten)]
    pub(crate) place: PlaceArgs,
    #[command(flatten)]
    pub(crate) of_file: FileArgs,
    #[command(flatten)]
    pub(crate) stack: StackArgs,
    #[command(flatten)]
    pub(crate) load: LoadTestArgs,
    #[command(flatten)]
    pub(crate) finding: FindingArgs,
}

// Where and when something was seen.
#[derive(Debug, Args)]
#[command(next_help_heading = "Where, when and with what (of a table: of rows that do not say it)")]
pub(crate) struct PlaceArgs {
    /// Where on the axis, 0 to 1, or from and to, such as 0.3,0.5
    #[arg(long, value_name = "X", value_parser = along)]
    pub(crate) along: Option<Along>,
    /// Face: front, right, back, left of what stands; top, bottom, front, back of what lies; crown,
    /// invert, left, right of a tunnel
    #[arg(long, value_name = "FACE", value_parser = face)]
    pub(crate) face: Option<Face>,
    /// Side, degrees about the axis, instead of a face
    #[arg(long, value_name = "DEG", allow_negative_numbers = true, conflicts_with = "face", value_parser = single)]
    pub(crate) angle: Option<f32>,
    /// Above the member's lowest point, m
    #[arg(long, value_name = "M", allow_negative_numbers = true, value_parser = single)]
    pub(crate) height: Option<f32>,
    /// When, such as 2026-05-03
    #[arg(long, value_name = "DATE", value_parser = |text: &str| text.parse::<Date>())]
    pub(crate) date: Option<Date>,
    /// What it was measured with
    #[arg(long, value_name = "NAME")]
    pub(crate) instrument: Option<String>,
    /// A photograph of a finding (.jpg, .png) for the report
    #[arg(long, value_name = "FILE", requires = "finding", conflicts_with = "files")]
    pub(crate) picture: Option<PathBuf>,
    /// It is meant as it is written: what is doubted counts
    #[arg(long)]
    pub(crate) confirmed: bool,
}

// What a file does not say itself.
#[derive(Debug, Args)]
#[command(next_help_heading = "What a file does not say itself")]
pub(crate) struct FileArgs {
    /// Unit of the column `value`, unless a column `unit` says it: of gauges ue, m/m, mm, m or MPa
    #[arg(long, value_name = "UNIT", requires = "files", conflicts_with = "finding")]
    pub(crate) unit: Option<String>,
    /// What the column `value` holds, where the table names no gauges
    #[arg(long, value_enum, requires = "files", conflicts_with = "finding")]
    pub(crate) kind: Option<KindArg>,
    /// Load test under which gauges were read
    #[arg(long, value_name = "NAME", requires = "files", conflicts_with = "finding")]
    pub(crate) test: Option<String>,
    /// CT slices: edge of a pixel, mm; what the files tell if absent
    #[arg(long, value_name = "MM", requires = "files", conflicts_with = "finding", value_parser = single)]
    pub(crate) pixel_mm: Option<f32>,
    /// The file is a photograph that is to be read, and this table says which places of the scene
    /// are where in it (`intrados photo` tries it)
    #[arg(long, value_name = "PICKS.csv", requires = "files", conflicts_with = "finding")]
    pub(crate) pose: Option<PathBuf>,
    /// Focal length of the photograph, pixels; what EXIF says if absent
    #[arg(long, value_name = "PX", requires = "pose", value_parser = focal_px)]
    pub(crate) focal_px: Option<f64>,
}

// Slices that lie behind each other.
#[derive(Debug, Args)]
#[command(next_help_heading = "A volume of CT slices")]
pub(crate) struct StackArgs {
    /// The files are one volume: its slices lie behind each other, and it is read across and along
    #[arg(long, requires = "files", conflicts_with = "finding")]
    pub(crate) stack: bool,
    /// Edges of a voxel, mm: to the right, down, from slice to slice; what the files tell if absent
    #[arg(long, value_name = "X,Y,Z", requires = "files", value_parser = triple::<f32>)]
    pub(crate) voxel_mm: Option<Triple<f32>>,
    /// The file is bare voxels, so many to the right, down, and slices
    #[arg(long, value_name = "X,Y,Z", requires = "files", value_parser = triple::<u32>)]
    pub(crate) raw: Option<Triple<u32>>,
    /// What a bare voxel is: u8, i8, u16, i16, u32, i32, f32 or f64
    #[arg(long, value_name = "TYPE", requires = "raw", default_value = "u16",
        value_parser = |text: &str| text.parse::<VoxelType>())]
    pub(crate) voxel_type: VoxelType,
    /// Bytes before the first bare voxel
    #[arg(long, value_name = "N", requires = "raw", default_value_t = 0)]
    pub(crate) skip_bytes: u64,
    /// Bare voxels have their highest byte first
    #[arg(long, requires = "raw")]
    pub(crate) big_endian: bool,
    /// Which way the member's axis runs in CT slices: to the right, down, or through them
    #[arg(long, value_enum, requires = "files", conflicts_with = "finding")]
    pub(crate) axis: Option<AxisArg>,
}

/// Three numbers with commas.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Triple<T>(pub(crate) [T; 3]);

fn triple<T: std::str::FromStr + Copy>(text: &str) -> Result<Triple<T>, String> {
    let all: Result<Vec<T>, _> = text.split([',', 'x', '×']).map(|n| n.trim().parse()).collect();
    match all.as_deref() {
        Ok(&[x, y, z]) => Ok(Triple([x, y, z])),
        _ => Err("write three numbers with commas, such as 512,512,400".into()),
    }
}

/// Which way a member's axis runs in pictures of its inside.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum AxisArg {
    Right,
    Down,
    Through,
}

impl From<AxisArg> for AxisRuns {
    fn from(axis: AxisArg) -> Self {
        match axis {
            AxisArg::Right => Self::Right,
            AxisArg::Down => Self::Down,
            AxisArg::Through => Self::Through,
        }
    }
}

// A load test under which gauges are read.
#[derive(Debug, Args)]
#[command(next_help_heading = "A load test, instead of a file")]
pub(crate) struct LoadTestArgs {
    /// Load test of this name: a weight on top, where --along says it; on the head of what stands.
    /// Given again, the test has one axle more
    #[arg(long, value_name = "NAME", group = "finding", requires = "force_kn")]
    pub(crate) load_test: Option<String>,
    /// The weight, kN
    #[arg(long, value_name = "KN", allow_negative_numbers = true)]
    pub(crate) force_kn: Option<f64>,
}

// One finding, in the words of a field book. Which options go together, the command looks after:
// clap passes over what an option requires where that conflicts with another.
#[derive(Debug, Args)]
#[command(next_help_heading = "A single finding, instead of a file")]
pub(crate) struct FindingArgs {
    /// Crack of this width, mm
    #[arg(long, value_name = "MM", group = "finding", requires = "course", value_parser = number)]
    pub(crate) crack: Option<f64>,
    /// How a crack runs
    #[arg(long, value_enum)]
    pub(crate) course: Option<CourseArg>,
    /// Length of a crack, m
    #[arg(long, value_name = "M", value_parser = number)]
    pub(crate) length_m: Option<f64>,
    /// Concrete come off over this area, m²
    #[arg(long, value_name = "M2", group = "finding", value_parser = number)]
    pub(crate) spall: Option<f64>,
    /// Depth of a spall; of CT slices, below the face
    #[arg(long, value_name = "MM", value_parser = number)]
    pub(crate) depth_mm: Option<f64>,
    /// Steel lies bare in a spall
    #[arg(long)]
    pub(crate) bars_bare: bool,
    /// Stains of rust over this area, m²
    #[arg(long, value_name = "M2", group = "finding", value_parser = number)]
    pub(crate) rust: Option<f64>,
    /// Lime or salts over this area, m²
    #[arg(long, value_name = "M2", group = "finding", value_parser = number)]
    pub(crate) efflorescence: Option<f64>,
    /// Wet over this area, m²
    #[arg(long, value_name = "M2", group = "finding", value_parser = number)]
    pub(crate) wet: Option<f64>,
    /// Area that sounds hollow, m² (0: none does)
    #[arg(long, value_name = "M2", group = "finding", requires = "tapped", value_parser = number)]
    pub(crate) hollow: Option<f64>,
    /// Area that was tapped for it, m²
    #[arg(long, value_name = "M2", value_parser = number)]
    pub(crate) tapped: Option<f64>,
    /// It was looked at there, and nothing was found
    #[arg(long, group = "finding")]
    pub(crate) intact: bool,
    /// Cover meter, mm
    #[arg(long, value_name = "MM", group = "finding", value_parser = number)]
    pub(crate) cover: Option<f64>,
    /// Half-cell potential, mV, mostly negative
    #[arg(long, value_name = "MV", group = "finding", allow_negative_numbers = true, value_parser = number)]
    pub(crate) half_cell: Option<f64>,
    /// What potentials were measured against; copper/copper sulphate if absent
    #[arg(long, value_enum)]
    pub(crate) electrode: Option<ElectrodeArg>,
    /// Rebound number
    #[arg(long, value_name = "N", group = "finding", value_parser = number)]
    pub(crate) rebound: Option<f64>,
    /// Ultrasonic pulse velocity, m/s
    #[arg(long, value_name = "M_S", group = "finding", value_parser = number)]
    pub(crate) velocity: Option<f64>,
    /// Depth of carbonation, mm
    #[arg(long, value_name = "MM", group = "finding", value_parser = number)]
    pub(crate) carbonation: Option<f64>,
    /// Chloride by depth, mm and % of cement, such as 5:1.1,15:0.6,25:0.3
    #[arg(long, value_name = "PROFILE", group = "finding", value_parser = profile)]
    pub(crate) chloride: Option<Profile>,
    /// The chloride is % of concrete, not of cement
    #[arg(long)]
    pub(crate) of_concrete: bool,
    /// Strength of a core, MPa
    #[arg(long, value_name = "MPA", group = "finding", requires_all = ["diameter_mm", "length_mm"])]
    pub(crate) core_strength: Option<f64>,
    /// Diameter of a core, of CT slices too
    #[arg(long, value_name = "MM", value_parser = number)]
    pub(crate) diameter_mm: Option<f64>,
    /// Length of a core as tested
    #[arg(long, value_name = "MM", value_parser = number)]
    pub(crate) length_mm: Option<f64>,
    /// Standard error in the finding's unit; the instrument's usual one if absent
    #[arg(long, value_name = "X", value_parser = number)]
    pub(crate) std_error: Option<f64>,
}

words! { KindArg for Kind: Cover => Kind::Cover, Rebound => Kind::Rebound, Velocity => Kind::Velocity, HalfCell => Kind::HalfCell, Carbonation => Kind::Carbonation }
words! { CourseArg for Course: Along => Course::Along, Across => Course::Across, Diagonal => Course::Diagonal, Map => Course::Map }
words! { ElectrodeArg for Electrode: CopperSulphate => Electrode::CopperSulphate, SilverChloride => Electrode::SilverChloride, Calomel => Electrode::Calomel }

/// A number that is one: not NaN, and not without end.
fn number(text: &str) -> Result<f64, String> {
    let wrong = || match text.split_once(',') {
        Some((whole, part)) if text.matches(',').count() == 1 => {
            format!("not a number: is that a decimal comma? write {whole}.{part}")
        }
        _ => "not a number".to_owned(),
    };
    text.trim().parse::<f64>().ok().filter(|n| n.is_finite()).ok_or_else(wrong)
}

/// The same in single precision.
fn single(text: &str) -> Result<f32, String> {
    number(text).map(|n| n as f32)
}

fn along(text: &str) -> Result<Along, String> {
    let (from, to) = text.split_once(',').unwrap_or((text, text));
    match [from, to].map(|end| end.trim().parse::<f32>()) {
        [Ok(from), Ok(to)] if from.is_finite() && to.is_finite() => Ok(Along([from, to])),
        [Ok(_), Ok(_)] => Err("not a number".into()),
        _ => {
            Err("write a place on the axis from 0 to 1, or two with a comma, such as 0.3,0.5"
                .into())
        }
    }
}

fn face(text: &str) -> Result<Face, String> {
    let names = || Face::ALL.map(|f| f.name().to_lowercase()).join(", ");
    Face::named(text).ok_or_else(|| format!("there are {}", names()))
}

/// Depths, mm, and contents, %.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Profile(pub(crate) Vec<[f64; 2]>);

fn profile(text: &str) -> Result<Profile, String> {
    let pair = |part: &str| {
        let (depth, percent) = part.split_once(':')?;
        let number = |text: &str| text.trim().parse().ok().filter(|n: &f64| n.is_finite());
        Some([number(depth)?, number(percent)?])
    };
    let pairs: Option<Vec<[f64; 2]>> = text.split(',').map(pair).collect();
    pairs.map(Profile).ok_or_else(|| {
        "not all of these are numbers: write depth in mm and content in % with a colon, pairs with commas, such as 5:1.1,15:0.6".into()
    })
}

#[derive(Debug, Args)]
pub(crate) struct Detach {
    /// A project's folder, which holds scene.ron, or a scene file
    #[arg(value_name = "FOLDER")]
    pub(crate) project: PathBuf,
    /// Id or name of the member
    #[arg(required_unless_present = "list", requires = "name")]
    pub(crate) member: Option<String>,
    /// Name under which it was attached
    pub(crate) name: Option<String>,
    /// List what is known of members: by evidence.ron, by the scene, by their tables
    #[arg(long, conflicts_with = "member")]
    pub(crate) list: bool,
}

fn exposure_classes(text: &str) -> Result<String, String> {
    let exposure =
        intrados_scene::structure::Exposure { class: text.into(), chloride: None, years: 0.0 };
    let known = |class: &str| intrados_scene::structure::Exposure::CLASSES.contains(&class);
    match exposure.classes().find(|class| !known(class)) {
        None if exposure.classes().next().is_some() => Ok(text.into()),
        _ => Err("give classes of EN 206: X0, XC1 to XC4, XD1 to XD3, XS1 to XS3, XF1 to XF4, XA1 to XA3".into()),
    }
}

#[derive(Debug, Args)]
pub(crate) struct Render {
    /// What to render
    pub(crate) scene: PathBuf,
    /// Folder for the files
    #[arg(long, value_name = "DIR", default_value = "out")]
    pub(crate) out: PathBuf,
    /// Name of the camera; the first one if absent
    #[arg(long, value_name = "NAME")]
    pub(crate) camera: Option<String>,
    /// Stops of exposure for the PNG, or `auto`; the camera's if absent, and auto for a bare model
    #[arg(long, value_name = "EV", allow_negative_numbers = true, value_parser = exposure)]
    pub(crate) exposure: Option<Exposure>,
    /// Walk one sample again, alone, and print all that it scored: pixel X, Y from the top left and
    /// the number of the sample, from 0 (with `--side dual`: the number of the walk; X and Y say
    /// nothing then)
    #[arg(long, value_name = "X,Y,SAMPLE", value_parser = replay)]
    pub(crate) replay: Option<Replay>,
    /// Cracks and missing cover that `intrados analyze --out` found (its cracks.json)
    #[arg(long, value_name = "FILE")]
    pub(crate) cracks: Option<PathBuf>,
    /// The damage that the scene has planted, with its true shape
    #[arg(long, conflicts_with = "cracks")]
    pub(crate) planted: bool,
    /// Show those cracks so many times as wide as they are
    #[arg(long, value_name = "X", default_value_t = 1.0, value_parser = widening)]
    pub(crate) widen: f32,
    #[command(flatten)]
    pub(crate) size: Size,
    #[command(flatten)]
    pub(crate) light: Light,
    #[command(flatten)]
    pub(crate) stop: Stop,
    #[command(flatten)]
    pub(crate) keep: Keep,
}

#[derive(Debug, Args)]
pub(crate) struct Measure {
    /// What to measure in
    pub(crate) scene: PathBuf,
    /// Folder for measure.json; nothing is written if absent (a shard's accumulator goes to `out`
    /// then)
    #[arg(long, value_name = "DIR")]
    pub(crate) out: Option<PathBuf>,
    /// All cameras, not only the first
    #[arg(long)]
    pub(crate) all: bool,
    /// Only the camera or meter of this name; may be given several times
    #[arg(long, value_name = "NAME", conflicts_with = "all")]
    pub(crate) sensor: Vec<String>,
    /// Where the variance comes from: of every surface its share by the error law, and how well the
    /// field predicted what its steps bring
    #[arg(long)]
    pub(crate) explain: bool,
    #[command(flatten)]
    pub(crate) size: Size,
    #[command(flatten)]
    pub(crate) light: Light,
    #[command(flatten)]
    pub(crate) stop: Stop,
    #[command(flatten)]
    pub(crate) keep: Keep,
}

#[derive(Debug, Args)]
pub(crate) struct Size {
    /// Pixels across, instead of the camera's
    #[arg(long, value_name = "N", value_parser = value_parser!(u32).range(1..=16_384))]
    pub(crate) width: Option<u32>,
    /// Pixels down, instead of the camera's
    #[arg(long, value_name = "N", value_parser = value_parser!(u32).range(1..=16_384))]
    pub(crate) height: Option<u32>,
}

// How light walks.
#[derive(Debug, Args)]
#[command(next_help_heading = "Walks")]
pub(crate) struct Light {
    /// Walk from the camera (primal), from the lamps (dual), or both; render: primal, measure: both
    #[arg(long, value_enum)]
    pub(crate) side: Option<SideArg>,
    /// How walks score
    #[arg(long, value_enum, default_value_t)]
    pub(crate) estimator: EstimatorArg,
    /// Surfaces on a path, the lamp's included (1 shows lamps alone); the scene's depth, else no
    /// limit
    #[arg(long, value_name = "N", value_parser = value_parser!(u32).range(1..))]
    pub(crate) max_depth: Option<u32>,
    /// First event at which Russian roulette may end a walk; the scene's, else 5
    #[arg(long, value_name = "N")]
    pub(crate) roulette_from: Option<u32>,
    /// From what roulette takes the probability to go on: what the surface reflects, or what the
    /// walk still carries
    #[arg(long, value_enum)]
    pub(crate) roulette: Option<RouletteArg>,
    /// Whether what one side's walks have learnt steers the other's: where it pays, always, or
    /// never. Learning takes at most half of what --spp and --time-limit allow
    #[arg(long, value_enum, default_value = "auto")]
    pub(crate) guide: GuideArg,
    /// What steers the walks from a file, instead of learning it; learnt and written there if there
    /// is none. Campaigns share it so
    #[arg(long, value_name = "FILE")]
    pub(crate) guide_from: Option<PathBuf>,
    /// Learn what steers the walks into that file, and end
    #[arg(long, hide = true, requires = "guide_from")]
    pub(crate) learn_only: bool,
    /// Seed of all random numbers
    #[arg(long, value_name = "N", default_value_t = 1)]
    pub(crate) seed: u64,
}

// When to stop: the first rule that is met wins and is named in the result.
#[derive(Debug, Args)]
#[command(
    next_help_heading = "Stop rules (the first one reached wins; render: 64 samples, measure: 1 % or 30 s if none is given)"
)]
pub(crate) struct Stop {
    /// Walks per pixel on each side (a meter counts as 4096 pixels)
    #[arg(long, value_name = "N", value_parser = value_parser!(u64).range(1..=1 << 40))]
    pub(crate) spp: Option<u64>,
    /// Wall-clock time of the walks, such as 90s, 500ms, 5m or 2h; stops at the end of a pass
    #[arg(long, value_name = "TIME", value_parser = duration)]
    pub(crate) time_limit: Option<Duration>,
    /// Relative standard error. measure: of every reading; render: of the pixels, root mean square
    /// over the picture's mean. An error bar that cannot be trusted yet (not converged) does not
    /// count
    #[arg(long, value_name = "X", value_parser = fraction)]
    pub(crate) target_rel_error: Option<f64>,
}

// Keeping the state of the work.
#[derive(Debug, Args)]
#[command(next_help_heading = "Long runs")]
pub(crate) struct Keep {
    /// Do part I of N (from 0) of the walks that --spp asks for, and write an accumulator for
    /// `merge`
    #[arg(long, value_name = "I/N", value_parser = shard, requires = "spp", conflicts_with = "target_rel_error")]
    pub(crate) shard: Option<Shard>,
    /// Write the state of the work here now and then, and at the end
    #[arg(long, value_name = "FILE")]
    pub(crate) checkpoint: Option<PathBuf>,
    /// How often
    #[arg(long, value_name = "TIME", default_value = "60s", value_parser = duration, requires = "checkpoint")]
    pub(crate) checkpoint_every: Duration,
    /// Go on from a checkpoint of the same command: the result has the same bits as without the
    /// interruption
    #[arg(long, value_name = "FILE")]
    pub(crate) resume: Option<PathBuf>,
}

#[derive(Debug, Args)]
pub(crate) struct Analyze {
    /// What to compute: a scene, a deck (.inp), or a Gmsh mesh (.msh)
    pub(crate) scene: PathBuf,
    /// Units of a deck, which says none itself: m,N (SI) or mm,N (MPa, t/mm³); of a mesh that of its
    /// lengths
    #[arg(long, value_name = "LENGTH,FORCE", value_parser = |text: &str| text.parse::<Units>())]
    pub(crate) units: Option<Units>,
    /// What the physical groups of a mesh are made of, what holds them and what acts on them (RON);
    /// NAME.groups.ron beside it if absent
    #[arg(long, value_name = "FILE")]
    pub(crate) groups: Option<PathBuf>,
    /// Only these members
    #[arg(long, value_name = "ID")]
    pub(crate) member: Vec<String>,
    /// All members of a scene as one frame of beams and plates: reactions, and the end forces of
    /// every member under the scene's loads, elastic; with --member, that member as usual, under
    /// what the others do to it
    #[arg(long)]
    pub(crate) whole: bool,
    /// With --whole: also without each member in turn, and what becomes of the others
    #[arg(long, requires = "whole")]
    pub(crate) redundancy: bool,
    /// Largest edge of an element, m, instead of one that suits the section
    #[arg(long, value_name = "M", value_parser = element)]
    pub(crate) element: Option<f64>,
    /// Only what lies between two shares of a member's axis, in finer bricks and driven at its cuts
    /// by the life of all of it: 0.4..0.6
    #[arg(long, value_name = "FROM..TO", value_parser = stretch, conflicts_with = "to_failure")]
    pub(crate) fine: Option<[f64; 2]>,
    /// Largest edge of an element between them, m; half of the others' if absent
    #[arg(long, value_name = "M", value_parser = element, requires = "fine")]
    pub(crate) fine_element: Option<f64>,
    /// Largest unbalanced force over all that acts at which a step counts as in equilibrium; 1e-3
    /// of a scene, 1e-8 of a deck if absent
    #[arg(long, value_name = "R", value_parser = tolerance)]
    pub(crate) tolerance: Option<f64>,
    /// After their life, raise loads of members until these fail, and beyond: --to-failure=NAME
    /// this load of the scene, --to-failure alone all forces, pressures and displacements (not
    /// weight and heat); what each bears, where its bars yield, how it fails
    #[arg(long, value_name = "LOAD", num_args = 0..=1, require_equals = true, default_missing_value = "")]
    pub(crate) to_failure: Option<String>,
    /// What keeps cracks from depending on the mesh: bands of one element (any element), or the
    /// implicit gradient (elements of at most half of --length)
    #[arg(long, value_name = "HOW", default_value = "band")]
    pub(crate) regularise: Regularise,
    /// Length of the implicit gradient, m: a crack's zone is some four of it wide; the largest
    /// aggregate's size or two of it
    #[arg(long, value_name = "M", default_value_t = 0.03, value_parser = length)]
    pub(crate) length: f64,
    /// What a crack leaves: planes that know directions, turn while they are young and interlock
    /// once they are grown, or one damage for all directions; planes with bands and diffuse with
    /// the gradient, which has no planes, if absent
    #[arg(long, value_name = "LAW")]
    pub(crate) crack_law: Option<CrackLaw>,
    /// Folder for VTU, PVD, CSV and JSON; nothing is written if absent
    #[arg(long, value_name = "DIR")]
    pub(crate) out: Option<PathBuf>,
    /// What was given of the options that belong to decks and scenes of members, as it is written.
    #[arg(skip)]
    pub(crate) of_members: Vec<String>,
}

fn widening(text: &str) -> Result<f32, String> {
    match text.parse::<f32>() {
        Ok(times) if (1.0..=100.0).contains(&times) => Ok(times),
        _ => Err("give a number from 1 to 100".into()),
    }
}

fn years(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(years) if (0.0..=200.0).contains(&years) => Ok(years),
        _ => Err("give years between 0 and 200".into()),
    }
}

fn stretch(text: &str) -> Result<[f64; 2], String> {
    let ends = text.split_once("..").and_then(|(a, b)| Some([a.parse().ok()?, b.parse().ok()?]));
    match ends {
        Some([from, to]) if 0.0 <= from && from < to && to <= 1.0 => Ok([from, to]),
        _ => Err("give two shares of the axis that rise from 0 to 1, such as 0.4..0.6".into()),
    }
}

fn element(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(edge) if (0.005..=10.0).contains(&edge) => Ok(edge),
        _ => Err("give metres between 0.005 and 10".into()),
    }
}

/// See [`Analyze::regularise`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum Regularise {
    Band,
    Gradient,
}

/// See [`Analyze::crack_law`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum CrackLaw {
    Diffuse,
    Planes,
}

fn length(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(length) if (0.001..=1.0).contains(&length) => Ok(length),
        _ => Err("give metres between 0.001 and 1".into()),
    }
}

fn tolerance(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(part) if (1e-9..=0.01).contains(&part) => Ok(part),
        _ => Err("give a number between 1e-9 and 0.01".into()),
    }
}

#[derive(Debug, Args)]
pub(crate) struct Scan {
    /// What to scan: a scene with a scanner. With --sinogram: the drawing of what it was taken of
    /// (--member, --along), and the scanner's data sheet, by which scatter, hardening and metal are
    /// corrected
    #[arg(required_unless_present = "sinogram")]
    pub(crate) scene: Option<PathBuf>,
    /// Folder for the files
    #[arg(long, value_name = "DIR", default_value = "out")]
    pub(crate) out: PathBuf,
    /// Only this scanner of the scene; the first one if absent
    #[arg(long, value_name = "NAME")]
    pub(crate) scanner: Option<String>,
    /// Only this member; may be given several times. All that the scanner names if absent
    #[arg(long, value_name = "ID")]
    pub(crate) member: Vec<String>,
    /// Place on the member's axis, 0 to 1, instead of the scanner's; may be given several times
    #[arg(long, value_name = "X", value_parser = share)]
    pub(crate) along: Vec<f32>,
    /// Cracks and missing cover that `intrados analyze --out` found (its cracks.json)
    #[arg(long, value_name = "FILE", conflicts_with = "sinogram")]
    pub(crate) cracks: Option<PathBuf>,
    /// Views, instead of the scanner's
    #[arg(long, value_name = "N", value_parser = value_parser!(u32).range(8..=100_000))]
    pub(crate) projections: Option<u32>,
    /// Pixels across the panel, instead of the scanner's: the field of view stays, voxels get
    /// larger. With --sinogram: across the slice
    #[arg(long, value_name = "N", value_parser = value_parser!(u32).range(8..=8192))]
    pub(crate) size: Option<u32>,
    /// Slices round each place
    #[arg(long, value_name = "N", default_value_t = 4, value_parser = value_parser!(u32).range(1..=256))]
    pub(crate) slices: u32,
    /// How high the beam is: jaws leave a slit that the slices need, or the whole panel is lit
    #[arg(long, value_enum, default_value_t)]
    pub(crate) beam: BeamArg,
    /// Corrections made: all, none, or some of scatter, hardening, rings, metal (with commas)
    #[arg(long, value_name = "LIST", default_value = "all", value_parser = corrections)]
    pub(crate) correct: Corrections,
    /// Seed of concrete and noise
    #[arg(long, value_name = "N", default_value_t = 1)]
    pub(crate) seed: u64,
    #[command(flatten)]
    pub(crate) given: Given,
}

// A sinogram of somebody else's.
#[derive(Debug, Args)]
#[command(next_help_heading = "Reconstructing a given sinogram (line integrals)")]
pub(crate) struct Given {
    /// TIFF stack (one page a view; a single page is the sinogram of one slice), folder of slices,
    /// or MetaImage
    #[arg(long, value_name = "FILE")]
    pub(crate) sinogram: Option<PathBuf>,
    /// How rays run
    #[arg(long, value_enum, default_value_t, requires = "sinogram", conflicts_with = "scene")]
    pub(crate) geometry: GeometryArg,
    /// Pages are sinograms (one a detector row) instead of views
    #[arg(long, requires = "sinogram")]
    pub(crate) by_row: bool,
    /// Edge of a detector pixel, mm; the file's if absent
    #[arg(long, value_name = "MM", requires = "sinogram", value_parser = above_zero)]
    pub(crate) pixel_mm: Option<f64>,
    /// From the first view to one past the last, degrees; 180 if parallel, else 360
    #[arg(long, value_name = "DEG", requires = "sinogram", conflicts_with = "scene", value_parser = above_zero)]
    pub(crate) arc_deg: Option<f64>,
    /// From the source to the axis, m (fan, cone)
    #[arg(long, value_name = "M", requires = "sinogram", conflicts_with = "scene", value_parser = above_zero)]
    pub(crate) source_m: Option<f64>,
    /// From the axis to the detector, m (fan, cone)
    #[arg(long, value_name = "M", requires = "sinogram", conflicts_with = "scene", value_parser = above_zero)]
    pub(crate) detector_m: Option<f64>,
    /// Bin, from 0 and with fractions, on which the axis falls; the middle if absent
    #[arg(long, value_name = "BIN", requires = "sinogram")]
    pub(crate) axis_bin: Option<f64>,
}

/// How high the beam is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, ValueEnum)]
pub(crate) enum BeamArg {
    /// As high as the slices need
    #[default]
    Slit,
    /// As high as the panel
    Cone,
}

/// How rays run.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, ValueEnum)]
pub(crate) enum GeometryArg {
    /// All rays of a view are parallel
    #[default]
    Parallel,
    /// From a line, each row a slice
    Fan,
    /// From a point
    Cone,
}

fn corrections(text: &str) -> Result<Corrections, String> {
    let mut corrections = match text {
        "all" => return Ok(Corrections::ALL),
        _ => Corrections::NONE,
    };
    for word in text.split(',').map(str::trim).filter(|w| *w != "none") {
        match word {
            "scatter" => corrections.scatter = true,
            "hardening" => corrections.hardening = true,
            "rings" => corrections.rings = true,
            "metal" => corrections.metal = true,
            _ => {
                return Err(format!(
                    "\"{word}\" is none of all, none, scatter, hardening, rings, metal"
                ));
            }
        }
    }
    Ok(corrections)
}

fn share(text: &str) -> Result<f32, String> {
    text.parse()
        .ok()
        .filter(|x| (0.0..=1.0).contains(x))
        .ok_or_else(|| "write a place on the axis from 0 to 1".into())
}

fn above_zero(text: &str) -> Result<f64, String> {
    text.parse()
        .ok()
        .filter(|x: &f64| *x > 0.0 && *x < 1e6)
        .ok_or_else(|| "write a number above 0".into())
}

#[derive(Debug, Args)]
pub(crate) struct Detect {
    /// Slices: TIFF or PNG, one channel, air dark
    #[arg(required = true, value_name = "SLICE")]
    pub(crate) slices: Vec<PathBuf>,
    /// Label masks (nonzero = pore): several of a slice by name (STEM_mask-*.tif), else one a slice
    /// in the same order
    #[arg(long, value_name = "MASK", num_args = 1..)]
    pub(crate) truth: Vec<PathBuf>,
    /// Edge of a pixel, mm; if absent, what the files tell, else lengths are in pixels
    #[arg(long, value_name = "MM")]
    pub(crate) pixel_mm: Option<f32>,
    /// Who decides what is a pore or a crack; auto: the network
    #[arg(long, value_enum, default_value_t)]
    pub(crate) method: Method,
    /// Refuse all if one slice is bad, instead of leaving it out
    #[arg(long)]
    pub(crate) strict: bool,
    /// Folder for labels, outlines and tables; nothing is written if absent
    #[arg(long, value_name = "DIR")]
    pub(crate) out: Option<PathBuf>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, ValueEnum)]
pub(crate) enum Method {
    /// The network
    #[default]
    Auto,
    /// The network
    Network,
    /// A local threshold, and a ridge filter for cracks
    Classical,
}

#[derive(Debug, Args)]
pub(crate) struct Photo {
    /// The scene that they show; or the first of photographs that are read as they are, in pixels
    pub(crate) scene: PathBuf,
    /// Photographs: JPEG, PNG or TIFF
    #[arg(value_name = "FILE")]
    pub(crate) files: Vec<PathBuf>,
    /// Table of picks: which place is where in which photograph, or which printed AprilTag (36h11)
    /// was stuck where on a member
    #[arg(long, value_name = "PICKS.csv")]
    pub(crate) pose: Option<PathBuf>,
    /// Print the numbered corners of this member, and nothing else
    #[arg(long, value_name = "MEMBER", conflicts_with_all = ["files", "pose"])]
    pub(crate) corners: Option<String>,
    /// Unroll this member alone; all that are seen if absent
    #[arg(long, value_name = "MEMBER")]
    pub(crate) member: Option<String>,
    /// Of the maps, mm a pixel; 1 if absent
    #[arg(long, value_name = "MM", value_parser = mm_per_px)]
    pub(crate) mm_per_px: Option<f64>,
    /// Folder with cameras.txt and images.txt of COLMAP: photographs that are in it stand where it
    /// says, in the frame of three or more places that are picked in two of them
    #[arg(long, value_name = "DIR", requires = "pose")]
    pub(crate) series: Option<PathBuf>,
    /// Focal length, pixels; what EXIF says if absent
    #[arg(long, value_name = "PX", value_parser = focal_px)]
    pub(crate) focal_px: Option<f64>,
    /// Standard error of a pick, pixels
    #[arg(long, value_name = "PX", default_value_t = 2.0, value_parser = picking_px)]
    pub(crate) picking_px: f64,
    /// Take the light off: maps of the faces' reflectance, with their errors, by the scene's lamps
    /// however brightly each burnt
    #[arg(long)]
    pub(crate) relight: bool,
    /// Take the light off and read what the faces show then: cracks with their widths, missing
    /// cover, rust, efflorescence
    #[arg(long)]
    pub(crate) read: bool,
    /// Which light is taken off before faces are read; direct and none are for comparison
    #[arg(long, value_enum, default_value_t = TakenOff::All)]
    pub(crate) light: TakenOff,
    /// Walks a lamp and pixel of the pictures of light, which are 256 pixels wide
    #[arg(long, value_name = "N", default_value_t = 64, value_parser = value_parser!(u64).range(2..=1 << 20))]
    pub(crate) spp: u64,
    /// Standard error of where shadows lie on the faces, mm: lamps and edges are not quite where
    /// the scene has them
    #[arg(long, value_name = "MM", default_value_t = 20.0, value_parser = shadow_error_mm)]
    pub(crate) shadow_error_mm: f64,
    /// Seed of the walks
    #[arg(long, value_name = "N", default_value_t = 1)]
    pub(crate) seed: u64,
    /// Folder for the files
    #[arg(long, value_name = "DIR", default_value = "out")]
    pub(crate) out: PathBuf,
}

impl Photo {
    /// Of the maps, mm a pixel.
    pub(crate) fn mm_per_px(&self) -> f64 {
        self.mm_per_px.unwrap_or(1.0)
    }
}

/// Which light is taken off a photograph.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum TakenOff {
    /// All, as often as it was reflected
    All,
    /// What comes straight from the lamps
    Direct,
    /// None: faces are read as they look
    None,
}

fn between(text: &str, low: f64, high: f64, unit: &str) -> Result<f64, String> {
    let value = text.parse().ok().filter(|x| (low..=high).contains(x));
    value.ok_or_else(|| format!("give {low} to {high} {unit}"))
}

fn mm_per_px(text: &str) -> Result<f64, String> {
    between(text, 0.01, 1000.0, "mm a pixel")
}

fn focal_px(text: &str) -> Result<f64, String> {
    between(text, 10.0, 1e6, "pixels")
}

fn shadow_error_mm(text: &str) -> Result<f64, String> {
    between(text, 0.0, 1000.0, "mm")
}

fn picking_px(text: &str) -> Result<f64, String> {
    between(text, 0.01, 100.0, "pixels")
}

#[derive(Debug, Args)]
pub(crate) struct Predict {
    /// What to look at
    pub(crate) scene: PathBuf,
    /// Grading profile: four_states, tight_cracks or a RON file; the one that the scene names if
    /// absent
    #[arg(long, value_name = "FILE")]
    pub(crate) profile: Option<PathBuf>,
    /// Who decides what is a pore or a crack in slices; auto: the network
    #[arg(long, value_enum, default_value_t)]
    pub(crate) method: Method,
    /// Years from now on that the forecast reaches
    #[arg(long, value_name = "YEARS", default_value_t = 20.0, value_parser = years)]
    pub(crate) ahead: f64,
    /// Edge of the elements of forecasts, m; some 150 elements a member if absent
    #[arg(long, value_name = "M", value_parser = element)]
    pub(crate) element: Option<f64>,
    /// Forecast nothing: no lives in finite elements
    #[arg(long, conflicts_with_all = ["ahead", "element"])]
    pub(crate) no_forecast: bool,
    /// Also what each member bears, as it is and as if it were sound: loads are raised until it
    /// fails, minutes a member
    #[arg(long, conflicts_with = "no_forecast")]
    pub(crate) strength: bool,
    /// Refuse all if one slice is bad, instead of leaving it out
    #[arg(long)]
    pub(crate) strict: bool,
    /// Samples a pixel of the report's pictures; 0: no pictures
    #[arg(long, value_name = "N", default_value_t = 16, value_parser = value_parser!(u64).range(0..=1 << 20))]
    pub(crate) spp: u64,
    /// Seed of the pictures
    #[arg(long, value_name = "N", default_value_t = 1)]
    pub(crate) seed: u64,
    /// The IFC model that the scene was imported from: a copy gets the results as property sets
    #[arg(long, value_name = "MODEL")]
    pub(crate) ifc: Option<PathBuf>,
    /// Print the report, too, as report.pdf (by WeasyPrint or Chromium)
    #[arg(long)]
    pub(crate) pdf: bool,
    /// Folder for the report and its tables
    #[arg(long, value_name = "DIR", default_value = "out")]
    pub(crate) out: PathBuf,
    #[command(flatten)]
    pub(crate) cover: Cover,
}

/// What stands on the cover of a report, in the place of what the scene's `project` says.
#[derive(Debug, Args)]
#[command(next_help_heading = "Cover of the report, instead of what the scene says")]
pub(crate) struct Cover {
    /// What its owner calls the structure
    #[arg(long, value_name = "NAME")]
    pub(crate) structure: Option<String>,
    /// Who owns it
    #[arg(long, value_name = "NAME")]
    pub(crate) owner: Option<String>,
    /// Who has inspected it
    #[arg(long, value_name = "NAME")]
    pub(crate) inspector: Option<String>,
    /// Where it stands
    #[arg(long, value_name = "TEXT")]
    pub(crate) place: Option<String>,
    /// Why it is looked at
    #[arg(long, value_name = "TEXT")]
    pub(crate) purpose: Option<String>,
    /// When it was inspected, such as 2026-05-03; what is to be done is due from then on
    #[arg(long, value_name = "DATE")]
    pub(crate) inspected: Option<Date>,
}

#[derive(Debug, Args)]
pub(crate) struct Experiment {
    /// Which one
    #[arg(value_enum)]
    pub(crate) name: ExperimentName,
    /// Cases by their numbers, such as 3 or 1..20 (both ends count)
    #[arg(long, value_name = "RANGE", default_value = "1..20", value_parser = case_range)]
    pub(crate) cases: CaseRange,
    /// Without the scatter correction, without steering at equal time, without the network: three
    /// columns more
    #[arg(long)]
    pub(crate) ablations: bool,
    /// What every correction earns, by nRMSE and score, instead of the table
    #[arg(long, conflicts_with = "ablations")]
    pub(crate) corrections: bool,
    /// Other pores, cracks, grains and noise in the same members: rehearsal N, on which choices
    /// were made
    #[arg(long, value_name = "N", value_parser = value_parser!(u64).range(..1000))]
    pub(crate) rehearsal: Option<u64>,
    /// Scenes or names of bundled scenes whose error bars are tried
    #[arg(long, value_name = "FILE", value_delimiter = ',', default_values_os_t = ["column", "beam", "tunnel"].map(PathBuf::from))]
    pub(crate) scenes: Vec<PathBuf>,
    /// Different damages planted in each of them
    #[arg(long, value_name = "N", default_value_t = 5, value_parser = value_parser!(u64).range(1..=1000))]
    pub(crate) plantings: u64,
    /// Folder for the table (JSON) and pictures of every case; nothing is written if absent
    #[arg(long, value_name = "DIR")]
    pub(crate) out: Option<PathBuf>,
}

/// An experiment by its name.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum ExperimentName {
    /// The paper's twenty cases: ours against two references
    #[value(name = "table-3-1")]
    Table31,
    /// Whether error bars of predictions hold the truth, over many plantings of damage
    Calibration,
}

/// First and last case, from 1.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct CaseRange(pub(crate) [usize; 2]);

fn case_range(text: &str) -> Result<CaseRange, String> {
    let (from, to) = text.split_once("..").unwrap_or((text, text));
    let ends = [from, to.trim_start_matches('=')].map(|t| t.trim().parse::<usize>().ok());
    match ends {
        [Some(from), Some(to)] if 1 <= from && from <= to && to <= 20 => Ok(CaseRange([from, to])),
        _ => Err("write a case from 1 to 20, or the first and the last, such as 1..20".into()),
    }
}

#[derive(Debug, Args)]
pub(crate) struct Campaign {
    #[command(subcommand)]
    pub(crate) step: CampaignStep,
}

#[derive(Debug, Subcommand)]
pub(crate) enum CampaignStep {
    /// Plans the units of work and writes them into a new folder
    #[command(
        after_help = "Examples:\n  intrados campaign new hall --command predict --over column.ron beam.ron bridge/ -- --ahead 30\n  intrados campaign new door64 --command measure --over door --split 64 -- --spp 65536 --seed 7\n  intrados campaign new roads --command predict --over bridges.csv --split 64\n  intrados campaign new cases --command experiment --over table-3-1 --split 20\n\nA table of bridges (.csv) becomes spans by stated rules (docs/network.md of this project), each with a life of its decisive section, or with --life full in finite elements. The rest of the command line, after --, goes to the command as it is; --out, --shard, --checkpoint, --resume and stop rules by clock are the campaign's own."
    )]
    New(CampaignNew),
    /// Does units: those named, a part of all, or all one after the other
    #[command(
        after_help = "Exit codes: 0 all of them are done (now or before), 75 to be started again: a signal, or another worker has one; else that of the first failure, which `status` lists. Other units go on."
    )]
    Run(CampaignRun),
    /// How far a campaign is, what failed and why, and how long it will take
    Status(CampaignFolder),
    /// Adds up what is done, in the order of the plan: CSV, JSON, Parquet, and of predictions a page
    #[command(
        after_help = "Fails with 65 and names the units where some are missing (unless --partial) or where two results of one unit differ."
    )]
    Collect(CampaignCollect),
    /// Writes and shows the job files of a scheduler, and hands them to it if asked
    #[command(
        group(clap::ArgGroup::new("engine").required(true)),
        after_help = "Examples:\n  intrados campaign launch door64 --slurm --submit\n  intrados campaign launch door64 --kubernetes --image registry/intrados:0.1.0 --claim data --submit"
    )]
    Launch(CampaignLaunch),
}

/// What a campaign may run.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum Job {
    Predict,
    Measure,
    Render,
    Scan,
    Analyze,
    Experiment,
}

/// How a span of a table lives.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, ValueEnum, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum LifeArg {
    /// Its decisive section: milliseconds
    #[default]
    Section,
    /// Finite elements: seconds to minutes
    Full,
}

#[derive(Debug, Args)]
pub(crate) struct CampaignNew {
    /// Folder to make
    pub(crate) dir: PathBuf,
    /// What is done in every unit
    #[arg(long, value_enum)]
    pub(crate) command: Job,
    /// Scenes, project folders, models, names of bundled scenes; or one table of bridges (.csv); or
    /// the experiment table-3-1
    #[arg(long, required = true, num_args = 1.., value_name = "STRUCTURE")]
    pub(crate) over: Vec<PathBuf>,
    /// Units per structure (measure, render: parts of the walks), of a table, or of an experiment's
    /// cases
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = value_parser!(u64).range(1..=1 << 16))]
    pub(crate) split: u64,
    /// A unit for every member (scan, analyze)
    #[arg(long)]
    pub(crate) each_member: bool,
    /// How spans of a table live
    #[arg(long, value_enum, default_value_t)]
    pub(crate) life: LifeArg,
    /// The year that is now, for a table
    #[arg(long, value_name = "YEAR", default_value_t = 2026, value_parser = value_parser!(i32).range(1900..=2200))]
    pub(crate) now: i32,
    /// Years from now on that a table's forecast reaches
    #[arg(long, value_name = "YEARS", default_value_t = 20.0, value_parser = years)]
    pub(crate) ahead: f64,
    /// Only the first rows of a table
    #[arg(long, value_name = "N")]
    pub(crate) first: Option<usize>,
    /// What goes to the command as it is, after --
    #[arg(last = true, value_name = "ARGS")]
    pub(crate) rest: Vec<String>,
}

#[derive(Debug, Args)]
pub(crate) struct CampaignFolder {
    /// The campaign's folder
    pub(crate) dir: PathBuf,
}

#[derive(Debug, Args)]
pub(crate) struct CampaignRun {
    /// The campaign's folder
    pub(crate) dir: PathBuf,
    /// Number of a unit, from 0; may be given several times
    #[arg(long, value_name = "K", conflicts_with = "part")]
    pub(crate) unit: Vec<usize>,
    /// Every N-th unit, from the I-th on
    #[arg(long, value_name = "I/N", value_parser = shard)]
    pub(crate) part: Option<Shard>,
}

#[derive(Debug, Args)]
pub(crate) struct CampaignCollect {
    /// The campaign's folder
    pub(crate) dir: PathBuf,
    /// Folder for what is collected; `collected` in the campaign's if absent
    #[arg(long, value_name = "DIR")]
    pub(crate) out: Option<PathBuf>,
    /// Take what there is, and say what is missing
    #[arg(long)]
    pub(crate) partial: bool,
}

#[derive(Debug, Args)]
pub(crate) struct CampaignLaunch {
    /// The campaign's folder
    pub(crate) dir: PathBuf,
    /// An array of Slurm, and a job that collects after it
    #[arg(long, group = "engine")]
    pub(crate) slurm: bool,
    /// A job file of HyperQueue, whose last task collects
    #[arg(long, group = "engine")]
    pub(crate) hyperqueue: bool,
    /// An Indexed Job of Kubernetes
    #[arg(long, group = "engine")]
    pub(crate) kubernetes: bool,
    /// So many processes of this machine
    #[arg(long, group = "engine", value_name = "N", value_parser = value_parser!(u16).range(1..=1024))]
    pub(crate) local: Option<u16>,
    /// Tasks that the units are dealt to; one for each, at most 1000, if absent
    #[arg(long, value_name = "N", value_parser = value_parser!(u64).range(1..=100_000))]
    pub(crate) tasks: Option<u64>,
    /// Cores of a task
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = value_parser!(u16).range(1..=1024))]
    pub(crate) cores: u16,
    /// Container with this program (Kubernetes)
    #[arg(long, value_name = "IMAGE", default_value = concat!("intrados:", env!("CARGO_PKG_VERSION")))]
    pub(crate) image: String,
    /// Persistent volume claim that holds the campaign's folder and the structures, under the same
    /// paths (Kubernetes)
    #[arg(long, value_name = "NAME", default_value = "intrados")]
    pub(crate) claim: String,
    /// Hand it to the scheduler: sbatch, hq, kubectl, or sh
    #[arg(long)]
    pub(crate) submit: bool,
}

#[derive(Debug, Args)]
pub(crate) struct Merge {
    /// Accumulators, in any order
    #[arg(required = true, value_name = "FILE")]
    pub(crate) files: Vec<PathBuf>,
    /// Stops of exposure for the PNG, or `auto`, instead of that of the accumulators
    #[arg(long, value_name = "EV", allow_negative_numbers = true, value_parser = exposure)]
    pub(crate) exposure: Option<Exposure>,
    /// Folder for the files
    #[arg(long, value_name = "DIR", default_value = "out")]
    pub(crate) out: PathBuf,
}

/// How bright the picture is developed.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub(crate) enum Exposure {
    /// Stops.
    Stops(f32),
    /// So that the picture's geometric mean becomes middle grey.
    Auto,
}

/// Pixel and sample to walk again.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Replay {
    pub(crate) pixel: [u32; 2],
    pub(crate) sample: u64,
}

words! { SideArg for Sides: Primal => Sides::Primal, Dual => Sides::Dual, Both => Sides::Both }
words! { GuideArg for Steering: Auto => Steering::Auto, On => Steering::On, Off => Steering::Off }
words! { RouletteArg for Roulette: Event => Roulette::Event, Weight => Roulette::Weight }

#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, ValueEnum)]
pub(crate) enum EstimatorArg {
    /// Survives with what the surface reflects, carries no weight, scores at every event
    Analog,
    /// Scores at every event, with weights
    Collision,
    /// Scores at absorption only
    LastEvent,
    /// Links every event to the lamps (or the camera) too, with multiple importance sampling
    #[default]
    NextEvent,
}

impl From<EstimatorArg> for Estimator {
    fn from(word: EstimatorArg) -> Self {
        match word {
            EstimatorArg::Analog => Self::Analog,
            EstimatorArg::Collision => Self::Collision,
            EstimatorArg::LastEvent => Self::LastEvent,
            EstimatorArg::NextEvent => Self::NextEvent,
        }
    }
}

fn duration(text: &str) -> Result<Duration, String> {
    let split = text.find(|c: char| c.is_ascii_alphabetic()).unwrap_or(text.len());
    let (number, unit) = text.split_at(split);
    let factor = match unit {
        "ms" => 1e-3,
        "s" | "" => 1.0,
        "m" | "min" => 60.0,
        "h" => 3600.0,
        _ => return Err("write a number and ms, s, m or h, such as 20s".into()),
    };
    let seconds = number
        .trim()
        .parse::<f64>()
        .map_err(|_| "write a number and ms, s, m or h, such as 20s")?
        * factor;
    if (0.0..=1e9).contains(&seconds) {
        Ok(Duration::from_secs_f64(seconds))
    } else {
        Err("must be from 0 to thirty years".into())
    }
}

fn fraction(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(x) if x > 0.0 && x <= 1.0 => Ok(x),
        _ => Err("write a number above 0 and up to 1, such as 0.01 for one per cent".into()),
    }
}

fn exposure(text: &str) -> Result<Exposure, String> {
    match text.parse::<f32>() {
        _ if text == "auto" => Ok(Exposure::Auto),
        Ok(x) if (-30.0..=30.0).contains(&x) => Ok(Exposure::Stops(x)),
        _ => Err("write `auto` or a number of stops from -30 to 30".into()),
    }
}

fn shard(text: &str) -> Result<Shard, String> {
    let numbers = text
        .split_once('/')
        .and_then(|(i, n)| Some((i.trim().parse().ok()?, n.trim().parse().ok()?)));
    match numbers {
        Some((index, of)) if index < of && of <= 1 << 16 => Ok(Shard { index, of }),
        _ => Err("write I/N with I from 0 to N-1, such as 0/4".into()),
    }
}

fn replay(text: &str) -> Result<Replay, String> {
    let mut parts = text.split(',').map(str::trim);
    let wrong = || "write three whole numbers with commas, such as 10,20,0".to_owned();
    let mut next = || parts.next().ok_or_else(wrong);
    let (x, y, sample) = (next()?, next()?, next()?);
    let pixel = [x.parse().map_err(|_| wrong())?, y.parse().map_err(|_| wrong())?];
    let sample = sample.parse::<u64>().ok().filter(|&s| s <= 1 << 40).ok_or_else(wrong)?;
    if parts.next().is_some() { Err(wrong()) } else { Ok(Replay { pixel, sample }) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_command_line_is_sound() {
        use clap::CommandFactory;
        Cli::command().debug_assert();
    }

    #[test]
    fn values_are_read_and_refused() {
        assert_eq!(duration("500ms"), Ok(Duration::from_millis(500)));
        assert_eq!(duration("1.5m"), Ok(Duration::from_secs(90)));
        assert!(["", "s", "-1s", "5 weeks", "NaN", "infs"].iter().all(|t| duration(t).is_err()));
        assert_eq!(shard("2/3"), Ok(Shard { index: 2, of: 3 }));
        assert!(["3/3", "1", "/", "-1/2", "0/0"].iter().all(|t| shard(t).is_err()));
        assert_eq!(replay("1, 2,3"), Ok(Replay { pixel: [1, 2], sample: 3 }));
        assert!(["1,2", "1,2,3,4", "a,b,c", "-1,0,0"].iter().all(|t| replay(t).is_err()));
        assert!(["0", "2", "NaN", "x"].iter().all(|t| fraction(t).is_err()));
        assert_eq!(
            [case_range("7"), case_range("1..20")],
            [Ok(CaseRange([7, 7])), Ok(CaseRange([1, 20]))]
        );
        assert!(["0", "21", "5..4", "1..", "x"].iter().all(|t| case_range(t).is_err()));
    }
}
