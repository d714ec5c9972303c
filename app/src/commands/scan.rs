//! `intrados scan`: members in the scanner, and given sinograms.

use std::{
    collections::{BTreeMap, BTreeSet},
    path::Path,
};

use intrados_scene::{Scene, SurfaceFile, structure::Scanner};
use intrados_stage::{
    cpu_seconds,
    file::{Set, file_name, file_names},
};
use intrados_xray::{
    correct::{Stripes, mend_dead_bins, no_integrals, remove_stripes, sinogram_doubts},
    recon::{self, Window, fbp, nrmse_in},
    scan::{
        Acquisition, Corrections, Counts, Detector, Drawing, Forming, Known, Protocol, Restored,
        ScatterMap, Target,
    },
    specimen::concrete::{Label, OUTSIDE, Subject},
    volume::{Beam, Depth, Grid, Orbit, Reader, Sinogram, VolumeError, Writer},
};
use serde::{Deserialize, Serialize};

use super::walks;
use crate::{
    args::{self, BeamArg, GeometryArg},
    failure::{Failure, Outcome},
    output::{self, Files},
    picture::{self, Facts},
    session::Session,
};

/// Bytes in which a given sinogram is reconstructed, slab by slab.
const MEMORY: u64 = 1 << 30;

/// What was scanned. Schema `intrados.scan/1`.
#[derive(Debug, Serialize)]
struct Report {
    schema: &'static str,
    version: &'static str,
    /// Scene, or file of the sinogram.
    scene: String,
    scene_hash: Option<String>,
    seed: u64,
    projections: usize,
    detector: Panel,
    corrections: Vec<&'static str>,
    /// Mean over the scans; of the panel's middle. `None` for a given sinogram without a drawing.
    scatter_to_primary: Option<f64>,
    /// Of the scatter that is taken off: root mean square of the relative errors of its patches.
    rel_error: Option<f64>,
    /// Of a given sinogram with a drawing: energy whose attenuation the slices show, and the share
    /// of its rays behind which nothing certain was left.
    kev: Option<f64>,
    starved: Option<f64>,
    cpu_seconds: f64,
    unit: &'static str,
    scans: Vec<Scan>,
    files: Vec<String>,
}

/// The panel, as far as it is lit.
#[derive(Debug, Serialize)]
struct Panel {
    width: usize,
    height: usize,
    pixel_mm: f64,
}

/// One place of one member.
#[derive(Debug, Serialize, Deserialize)]
struct Scan {
    member: String,
    along: f32,
    /// A core of it, where the whole section does not fit.
    core: bool,
    size: [usize; 3],
    voxel_mm: f64,
    /// Energy whose attenuation the slices show.
    kev: f64,
    scatter_to_primary: f64,
    rel_error: f64,
    /// Share of the rays through the slices behind which nothing certain was left.
    starved: f64,
    /// Root mean square error of the slices against the truth, over its largest value, in the
    /// specimen.
    nrmse: f64,
    /// True shares of pores and of cracks in the slices.
    porosity: f64,
    cracks: f64,
    /// Pores that the slices meet.
    pores: usize,
    cpu_seconds: f64,
}

pub(crate) fn run(session: &Session, args: &args::Scan) -> Result<Outcome, Failure> {
    match (&args.given.sinogram, &args.scene) {
        (Some(path), Some(scene)) => drawn(session, args, path, scene),
        (Some(path), None) => given(session, args, path),
        (None, Some(path)) => scenes(session, args, path),
        (None, None) => Err(Failure::Usage("name a scene, or --sinogram FILE".into())),
    }
}

/// What to scan, from the scene.
fn scenes(session: &Session, args: &args::Scan, path: &Path) -> Result<Outcome, Failure> {
    let scene = walks::load(session, path)?;
    let damage = match &args.cracks {
        Some(file) => SurfaceFile::read(file, &scene)?.members,
        None => Vec::new(),
    };
    let scanner = scanner(&scene, args.scanner.as_deref())?;
    let members = members(&scene, scanner, &args.member)?;
    let places =
        if args.along.is_empty() { scanner.orbit.along.clone() } else { args.along.clone() };
    let [views, size] = [args.projections, args.size].map(|n| n.map(|n| n as usize));
    let open = Protocol::of_scene(scanner, views, size, Detector::default())?;
    let protocol = match args.beam {
        BeamArg::Cone => open,
        BeamArg::Slit => {
            let across = open.field();
            open.slit(args.slices as usize, across)
        }
    };
    let mut report =
        Report::new(&scene.name, Some(scene.hash.clone()), args, &protocol.orbit, args.correct);
    let names = Stems::new(&scene, &places);
    let key = (&scene.hash, &damage, &protocol, args.slices, args.correct, args.seed);
    let (files, scans) = output::in_parts(session, &args.out, &key, |files| {
        let _progress = session.watch("scanning");
        let mut scans = Vec::new();
        for (&member, &along) in
            members.iter().flat_map(|member| places.iter().map(move |along| (member, along)))
        {
            scans.push(files.part(&format!("{} {along}", member.id()), |files| {
                let begin = cpu_seconds();
                let seed = args.seed
                    ^ intrados_stage::random::Key::new(
                        hash(member.id()),
                        u64::from(along.to_bits()),
                    )
                    .bits(0) as u64;
                let taken =
                    Taken::scan(session, member.worn(&damage), along, &protocol, args, seed)?;
                let scan = taken.about(member, along)?;
                session.job.relabel(format!("writing {} at {along}", member.id()));
                taken.write(files, &names.of(member.id(), along), &report, &scan)?;
                Ok::<_, Failure>(Scan { cpu_seconds: cpu_seconds() - begin, ..scan })
            })?);
        }
        Ok(scans)
    })?;
    report.scans = scans;
    let n = report.scans.len().max(1) as f64;
    report.scatter_to_primary =
        Some(report.scans.iter().map(|s| s.scatter_to_primary).sum::<f64>() / n);
    report.rel_error = Some(report.scans.iter().map(|s| s.rel_error).fold(0.0, f64::max));
    report.finish(session, files)
}

/// Beginnings of the files' names.
struct Stems {
    members: BTreeMap<String, String>,
    /// Digits that tell places apart.
    digits: usize,
}

impl Stems {
    fn new(scene: &Scene, places: &[f32]) -> Self {
        let ids: Vec<&String> = scene.structure.assemblies.iter().map(|a| &a.id).collect();
        let members = ids.iter().map(|&id| id.clone()).zip(file_names(&ids)).collect();
        let different = |digits: &usize| {
            places.iter().map(|along| format!("{along:.digits$}")).collect::<BTreeSet<_>>().len()
                == places.len()
        };
        Self { members, digits: (3..9).find(different).unwrap_or(9) }
    }

    fn of(&self, member: &str, along: f32) -> String {
        let name = self.members.get(member).map_or_else(|| file_name(member), String::clone);
        format!("{name}_{along:.0$}", self.digits)
    }
}

/// A number of a name, the same everywhere.
fn hash(name: &str) -> u64 {
    name.bytes()
        .fold(0xcbf2_9ce4_8422_2325, |h, b| (h ^ u64::from(b)).wrapping_mul(0x0100_0000_01b3))
}

fn scanner<'a>(scene: &'a Scene, name: Option<&str>) -> Result<&'a Scanner, Failure> {
    let all = &scene.structure.scanners;
    match name {
        None => all.first().ok_or_else(|| {
            Failure::BadInput(format!(
                "{} has no scanner: add one to its file (scanners)",
                scene.name
            ))
        }),
        Some(name) => all.iter().find(|s| s.name == name).ok_or_else(|| {
            let names: Vec<&str> = all.iter().map(|s| s.name.as_str()).collect();
            Failure::Usage(format!(
                "{} has no scanner \"{name}\": there are {}",
                scene.name,
                names.join(", ")
            ))
        }),
    }
}

/// The members to scan: those that are asked for, or all of the scanner.
fn members<'a>(
    scene: &'a Scene,
    scanner: &Scanner,
    wanted: &[String],
) -> Result<Vec<Subject<'a>>, Failure> {
    let ids = if wanted.is_empty() { &scanner.members } else { wanted };
    let find = |word: &String| {
        // An assembly of the scene is no member of its own: it is known by its id alone.
        let id = scene.id_of(word).unwrap_or(word);
        Subject::of(scene, id).map_err(|_| {
            let known: Vec<&str> = scene
                .structure
                .assemblies
                .iter()
                .filter(|a| a.body.is_some())
                .map(|a| a.id.as_str())
                .collect();
            let message = format!(
                "{} has no member \"{id}\" of which it tells the inside: there are {}",
                scene.name,
                known.join(", ")
            );
            if wanted.is_empty() { Failure::BadInput(message) } else { Failure::Usage(message) }
        })
    };
    ids.iter().map(find).collect()
}

/// A scan in memory.
struct Taken {
    target: Target,
    scatter_map: ScatterMap,
    restored: Restored,
}

impl Taken {
    fn scan(
        session: &Session,
        member: Subject,
        along: f32,
        protocol: &Protocol,
        args: &args::Scan,
        seed: u64,
    ) -> Result<Self, Failure> {
        let job = &session.job;
        let taken = Acquisition::take(
            member,
            along,
            protocol,
            args.slices as usize,
            seed,
            &Forming::default(),
            job,
        )?;
        let restored = taken.restore(args.correct, job)?;
        let Acquisition { target, scatter_map, .. } = taken;
        Ok(Self { target, scatter_map, restored })
    }

    fn about(&self, member: Subject, along: f32) -> Result<Scan, Failure> {
        let truth = self.target.attenuation(self.restored.kev)?;
        let painted = &self.target.truth;
        let grid = &self.target.slices;
        let body = |i: usize| painted.labels[i] != OUTSIDE;
        let share = |k: usize| painted.voids[k] as f64 / painted.points.max(1) as f64;
        let half = 0.5 * grid.voxel[2] * grid.size[2] as f64;
        Ok(Scan {
            member: member.id().to_owned(),
            along,
            core: self.target.place.is_some_and(|p| p.core),
            size: grid.size,
            voxel_mm: 1e3 * grid.voxel[0],
            kev: self.restored.kev,
            scatter_to_primary: self.scatter_map.to_primary,
            rel_error: self.scatter_map.rel_error,
            starved: self.restored.starved,
            nrmse: nrmse_in(&self.restored.volume.data, &truth, body),
            porosity: share(0),
            cracks: share(1),
            pores: self
                .target
                .concrete
                .pores()
                .filter(|p| p.centre.z.abs() < half + p.extent().z)
                .count(),
            cpu_seconds: 0.0,
        })
    }

    /// Projections, slices, masks, pictures, pores.
    fn write(
        &self,
        files: &mut Set,
        stem: &str,
        report: &Report,
        scan: &Scan,
    ) -> Result<(), Failure> {
        let projections = &self.restored.projections;
        let orbit = &projections.orbit;
        let stack = Grid::centred(
            [orbit.bins(), orbit.rows(), orbit.views()],
            [orbit.pixel[0], orbit.pixel[1], 1e-3],
        );
        let note = report.note("line integrals, no unit", scan);
        tiff(
            files,
            &format!("{stem}-projections.tif"),
            stack,
            &projections.data,
            Depth::Float,
            &note,
        )?;

        let grid = self.target.slices.slab(0..1);
        let n = grid.slice_len();
        let codes = Depth::Sixteen { low: 0.0, high: 65_535.0 };
        let range = window(&self.restored.volume.data);
        let size = [grid.size[0] as u32, grid.size[1] as u32];
        for (z, (slice, labels)) in
            self.restored.volume.data.chunks(n).zip(self.target.truth.labels.chunks(n)).enumerate()
        {
            let file = |what: &str| format!("{stem}_slice-{:03}{what}", z + 1);
            tiff(
                files,
                &file(".tif"),
                grid,
                slice,
                Depth::Float,
                &report.note("attenuation, 1/m", scan),
            )?;
            let all: Vec<f32> = labels.iter().map(|l| f32::from(*l)).collect();
            tiff(
                files,
                &file("_truth.tif"),
                grid,
                &all,
                codes,
                &report.note("0 outside, 1 matrix, 2 pore, 3 crack, 4 steel", scan),
            )?;
            let pores: Vec<f32> =
                labels.iter().map(|l| f32::from(u8::from(*l == Label::Pore as u8))).collect();
            tiff(
                files,
                &file("_mask-pore.tif"),
                grid,
                &pores,
                codes,
                &report.note("1 where a pore is", scan),
            )?;
            files.write(
                file(".png"),
                &picture::png_of_colours(
                    size,
                    &grey(slice, grid.size[0], range),
                    &report.facts(scan, range),
                )?,
            )?;
        }
        files.write(format!("{stem}-pores.csv"), self.pores().as_bytes())
    }

    /// The true pores that the slices meet.
    fn pores(&self) -> String {
        let half = 0.5 * self.target.slices.voxel[2] * self.target.slices.size[2] as f64;
        let mut text = String::from("pore,x_mm,y_mm,z_mm,diameter_mm,volume_mm3\n");
        let met = self.target.concrete.pores().filter(|p| p.centre.z.abs() < half + p.extent().z);
        for (i, pore) in met.enumerate() {
            let c = 1e3 * pore.centre;
            text += &format!(
                "{},{:.4},{:.4},{:.4},{:.4},{:.5}\n",
                i + 1,
                c.x,
                c.y,
                c.z,
                1e3 * pore.diameter,
                1e9 * pore.volume()
            );
        }
        text
    }
}

fn tiff(
    files: &mut Set,
    name: &str,
    grid: Grid,
    data: &[f32],
    depth: Depth,
    note: &str,
) -> Result<(), Failure> {
    let failed = unwritten(&files.folder().join(name));
    let mut writer = pages(files, name, grid, depth, note)?;
    writer.write_slab(data).map_err(&failed)?;
    writer.finish().map_err(&failed)
}

/// Begins a TIFF.
fn pages(
    files: &mut Set,
    name: &str,
    grid: Grid,
    depth: Depth,
    note: &str,
) -> Result<Writer, Failure> {
    Ok(Writer::create(&files.place(name), grid, depth)
        .map_err(unwritten(&files.folder().join(name)))?
        .noted(note))
}

fn unwritten(path: &Path) -> impl Fn(VolumeError) -> Failure + use<> {
    let path = path.to_owned();
    move |e| match e {
        VolumeError::Missing { source, .. } => Failure::cannot_write(&path, source),
        other => Failure::cannot_write(&path, other),
    }
}

/// Black and white of a picture: nothing, and a little more than the concrete, so that steel is
/// white.
fn window(values: &[f32]) -> [f32; 2] {
    let mut sorted: Vec<f32> = values.iter().copied().filter(|v| v.is_finite()).collect();
    if sorted.is_empty() {
        return [0.0, 1.0];
    }
    let at = (0.9 * (sorted.len() - 1) as f64) as usize;
    let high = *sorted.select_nth_unstable_by(at, f32::total_cmp).1;
    [0.0, 1.3 * high.max(f32::MIN_POSITIVE)]
}

/// Grey, with y up.
fn grey(slice: &[f32], width: usize, [low, high]: [f32; 2]) -> Vec<[u8; 3]> {
    let code = |v: &f32| [(((v - low) / (high - low)).clamp(0.0, 1.0) * 255.0).round() as u8; 3];
    slice.chunks(width).rev().flat_map(|row| row.iter().map(code)).collect()
}

/// Reconstructs line integrals that somebody else has measured, slab by slab: neither they nor the
/// slices need to fit into memory.
fn given(session: &Session, args: &args::Scan, path: &Path) -> Result<Outcome, Failure> {
    let Corrections { scatter, hardening, metal, rings } = args.correct;
    // All of them is what is done unless somebody says otherwise.
    let is_all = scatter && hardening && metal && rings;
    if (scatter || hardening || metal) && !is_all {
        return Err(Failure::Usage(
            "--correct: scatter, hardening and metal need the SCENE that draws what --sinogram is of: name it with --member and --along, or give --correct rings"
                .into(),
        ));
    }
    let _progress = session.watch(format!("reading {}", path.display()));
    let begin = cpu_seconds();
    let pixel = args.given.pixel_mm.map(|mm| [1e-3 * mm; 3]);
    let mut reader = Reader::open_within(path, pixel, &session.access)?;
    let by_row = args.given.by_row || reader.grid().size[2] == 1;
    let orbit = orbit(&args.given, reader.grid())?;
    let across = args.size.map_or(orbit.bins(), |n| n as usize);
    let voxel = orbit.pixel[0] / orbit.beam.magnification() * orbit.bins() as f64 / across as f64;
    let high = if matches!(orbit.beam, Beam::Cone { .. }) {
        orbit.pixel[1] / orbit.beam.magnification()
    } else {
        orbit.pixel[1]
    };
    let grid = Grid::centred([across, across, orbit.rows()], [voxel, voxel, high]);
    bearable(&orbit, &grid.slab(0..1))?;
    let mut made = args.correct;
    // The others need a drawing and a data sheet.
    (made.scatter, made.hardening, made.metal) = (false, false, false);
    let stem = file_name(&path.file_stem().unwrap_or_default().to_string_lossy());
    let [tif, png] = ["slices.tif", "middle.png"].map(|what| format!("{stem}-{what}"));
    let failed = unwritten(&args.out.join(&tif));
    let mut slices = None;
    let (mut first, mut middle) = (0, Vec::new());
    while first < grid.size[2] {
        let z = recon::slab(&orbit, &grid, first, MEMORY);
        let part = grid.slab(z.clone());
        let place = format!("slices {} to {} of {}", z.start + 1, z.end, grid.size[2]);
        session.job.relabel(format!("reading {place}"));
        let mut sinogram =
            Sinogram::read(&mut reader, &orbit, by_row, recon::rows(&orbit, &part), &session.job)?;
        doubted(path, &mut sinogram, args.given.arc_deg.is_some(), first == 0)?;
        if made.rings {
            without_stripes(&mut sinogram, session)?;
        }
        session.job.relabel(format!("reconstructing {place}"));
        let volume = fbp(&sinogram, &part, Window::SheppLogan, &session.job)?;
        // What cannot be read is found before anything is written, as far as one reading shows it.
        let (files, mut writer) = match slices.take() {
            Some(begun) => begun,
            None => {
                let mut files = output::begin(&args.out)?;
                let note = format!("unit=1/m\nintrados={}\n", env!("CARGO_PKG_VERSION"));
                let writer = pages(&mut files, &tif, grid, Depth::Float, &note)?;
                (files, writer)
            }
        };
        writer.write_slab(&volume.data).map_err(&failed)?;
        slices = Some((files, writer));
        if z.contains(&(grid.size[2] / 2)) {
            middle = volume.slice(grid.size[2] / 2 - z.start).to_vec();
        }
        first = z.end;
    }
    let Some((mut files, writer)) = slices else {
        return Err(Failure::BadInput(format!("{}: has no slices", path.display())));
    };
    writer.finish().map_err(&failed)?;
    show(&mut files, png, &middle, across)?;
    let mut report = Report::new(&path.display().to_string(), None, args, &orbit, made);
    report.cpu_seconds = cpu_seconds() - begin;
    report.finish(session, files)
}

/// Refuses what are no line integrals, mends dead bins, and says what speaks against the first rows.
fn doubted(
    path: &Path,
    sinogram: &mut Sinogram,
    is_arc_given: bool,
    is_first: bool,
) -> Result<(), Failure> {
    let name = path.display();
    if let Some(why) = no_integrals(sinogram) {
        return Err(Failure::BadInput(format!("{name}: {why}")));
    }
    let dead = mend_dead_bins(sinogram);
    if !is_first {
        return Ok(());
    }
    if let Some(bin) = dead.first() {
        let others = match dead.len() - 1 {
            0 => String::new(),
            n => format!(" and {n} more"),
        };
        tracing::warn!(
            "{name}: bin {bin}{others} reads the same in every view and is dead: it gets the mean of its neighbours, or a ring would show"
        );
    }
    for doubt in sinogram_doubts(sinogram, is_arc_given) {
        tracing::warn!("{name}: {doubt}");
    }
    Ok(())
}

/// Refuses slices that take too much memory with their rays.
fn bearable(orbit: &Orbit, grid: &Grid) -> Result<(), Failure> {
    let ([least, most], [x, y, n]) =
        ([recon::bytes(orbit, grid), 4 * MEMORY].map(|b| b as f64 / f64::from(1 << 30)), grid.size);
    if least <= most {
        return Ok(());
    }
    let what = if n == 1 { "a slice".to_owned() } else { format!("{n} slices") };
    Err(Failure::Usage(format!(
        "{what} of {x} × {y} would take {least:.0} GB of memory with the rays, over {most:.0}: give a smaller --size"
    )))
}

/// Writes a picture of a slice.
fn show(files: &mut Set, png: String, slice: &[f32], across: usize) -> Result<(), Failure> {
    let range = window(slice);
    let facts = vec![("Range", format!("grey, {:.4} to {:.4} 1/m", range[0], range[1]))];
    files.write(
        png,
        &picture::png_of_colours(
            [across as u32, across as u32],
            &grey(slice, across, range),
            &facts,
        )?,
    )
}

/// Reconstructs line integrals that somebody else has measured of a member that the scene draws, by
/// a scanner whose data sheet the scene has: with all corrections.
fn drawn(
    session: &Session,
    args: &args::Scan,
    path: &Path,
    scene: &Path,
) -> Result<Outcome, Failure> {
    let begin = cpu_seconds();
    let scene = walks::load(session, scene)?;
    let sheet = scanner(&scene, args.scanner.as_deref())?;
    let ([member], [along]) = (&members(&scene, sheet, &args.member)?[..], &args.along[..]) else {
        return Err(Failure::Usage(
            "say of what the sinogram is: one --member ID, one --along X".into(),
        ));
    };
    let progress = session.watch(format!("reading {}", path.display()));
    let pixel = args.given.pixel_mm.map(|mm| [1e-3 * mm; 3]);
    let mut reader = Reader::open_within(path, pixel, &session.access)?;
    let [bins, rows, pages] = reader.grid().size;
    let by_row = args.given.by_row || pages == 1;
    let (views, rows) = if by_row { (rows, pages) } else { (pages, rows) };
    let open = Protocol::of_scene(sheet, Some(views), Some(bins), Detector::default())?;
    let most = open.orbit.rows();
    let mut protocol = open.lit(rows).ok_or_else(|| {
        let name = &sheet.name;
        Failure::BadInput(format!(
            "{}: has {rows} rows; with {bins} bins the panel of scanner \"{name}\" has {most}",
            path.display()
        ))
    })?;
    let [theirs, ours] = [reader.grid().voxel[0], protocol.orbit.pixel[0]].map(|m| 1e3 * m);
    if (theirs / ours - 1.0).abs() > 0.02 {
        let name = &sheet.name;
        return Err(Failure::BadInput(format!(
            "{}: its bins are {theirs:.4} mm wide, {bins} of scanner \"{name}\" {ours:.4} mm: name the scanner (--scanner), or the width (--pixel-mm)",
            path.display()
        )));
    }
    if let Some(bin) = args.given.axis_bin {
        protocol.orbit.centre[0] = bin;
    }
    let drawing = Drawing::of_member(*member, *along, &protocol)?;
    let mut slices = protocol.slices(drawing.outline.reach(), (args.slices as usize).min(rows));
    if let Some(size) = args.size.map(|n| n as usize) {
        let edge = slices.voxel[0] * slices.size[0] as f64 / size as f64;
        slices = Grid::centred([size, size, slices.size[2]], [edge, edge, slices.voxel[2]]);
    }
    bearable(&protocol.orbit, &slices)?;
    let mut sinogram = Sinogram::read(&mut reader, &protocol.orbit, by_row, 0..rows, &session.job)?;
    doubted(path, &mut sinogram, true, true)?;
    let counts = Counts::by_sheet(&protocol);
    let known = Known { protocol, drawing, slices };
    let scatter_map =
        if args.correct.scatter { Some(known.scatter_map(args.seed, &session.job)?) } else { None };
    let restored = known.slices_of(
        sinogram,
        counts,
        scatter_map.as_ref(),
        args.correct,
        Window::Hann,
        &session.job,
    )?;
    drop(progress);
    let mut files = output::begin(&args.out)?;
    let stem = file_name(&path.file_stem().unwrap_or_default().to_string_lossy());
    let [tif, png] = ["slices.tif", "middle.png"].map(|what| format!("{stem}-{what}"));
    let note =
        format!("unit=1/m at {:.1} keV\nintrados={}\n", restored.kev, env!("CARGO_PKG_VERSION"));
    tiff(&mut files, &tif, slices, &restored.volume.data, Depth::Float, &note)?;
    show(&mut files, png, restored.volume.slice(slices.size[2] / 2), slices.size[0])?;
    let orbit = &known.protocol.orbit;
    let mut report = Report::new(
        &path.display().to_string(),
        Some(scene.hash.clone()),
        args,
        orbit,
        args.correct,
    );
    report.scatter_to_primary = scatter_map.as_ref().map(|v| v.to_primary);
    report.rel_error = scatter_map.as_ref().map(|v| v.rel_error);
    (report.kev, report.starved) = (Some(restored.kev), Some(restored.starved));
    report.cpu_seconds = cpu_seconds() - begin;
    report.finish(session, files)
}

/// Removes the stripes of every row, from which rings would come.
fn without_stripes(sinogram: &mut Sinogram, session: &Session) -> Result<(), Failure> {
    let [rows, bins] = sinogram.orbit.detector;
    let stripes = Stripes {
        large: (bins / 14).max(9) | 1,
        small: (bins / 33).max(5) | 1,
        ..Stripes::default()
    };
    for row in 0..rows {
        session.job.step(row, rows)?;
        let mut lines = sinogram.row(row);
        remove_stripes(&mut lines, bins, stripes);
        for (view, line) in lines.chunks(bins).enumerate() {
            let at = (view * rows + row) * bins;
            sinogram.data[at..at + line.len()].copy_from_slice(line);
        }
    }
    Ok(())
}

/// Rays of a given sinogram.
fn orbit(given: &args::Given, stack: &Grid) -> Result<Orbit, Failure> {
    let [bins, rows, pages] = stack.size;
    // A page is a view, or the sinogram of a row.
    let (views, rows) = if given.by_row || pages == 1 { (rows, pages) } else { (pages, rows) };
    let distances = || match (given.source_m, given.detector_m) {
        (Some(source), Some(detector)) => Ok((source, detector)),
        _ => Err(Failure::Usage("fan and cone need --source-m and --detector-m".into())),
    };
    let beam = match given.geometry {
        GeometryArg::Parallel => Beam::Parallel,
        GeometryArg::Fan => distances().map(|(source_axis, axis_detector)| Beam::Fan {
            source_axis,
            axis_detector,
            curved: false,
        })?,
        GeometryArg::Cone => distances()
            .map(|(source_axis, axis_detector)| Beam::Cone { source_axis, axis_detector })?,
    };
    let usual = if given.geometry == GeometryArg::Parallel { 180.0 } else { 360.0 };
    let arc = given.arc_deg.unwrap_or(usual).to_radians();
    let mut orbit = Orbit::circle(beam, views, arc, [rows, bins], [stack.voxel[0], stack.voxel[1]]);
    // Rows of sinograms are as high as their bins are wide.
    if given.by_row || pages == 1 {
        orbit.pixel[1] = orbit.pixel[0];
    }
    if let Some(bin) = given.axis_bin {
        orbit.centre[0] = bin;
    }
    Ok(orbit)
}

impl Report {
    fn new(
        scene: &str,
        scene_hash: Option<String>,
        args: &args::Scan,
        orbit: &Orbit,
        made: Corrections,
    ) -> Self {
        let Corrections { scatter, hardening, rings, metal } = made;
        let words =
            [(scatter, "scatter"), (hardening, "hardening"), (rings, "rings"), (metal, "metal")];
        Self {
            schema: "intrados.scan/1",
            version: env!("CARGO_PKG_VERSION"),
            scene: scene.to_owned(),
            scene_hash,
            seed: args.seed,
            projections: orbit.views(),
            detector: Panel {
                width: orbit.bins(),
                height: orbit.rows(),
                pixel_mm: 1e3 * orbit.pixel[0],
            },
            corrections: words.iter().filter(|w| w.0).map(|w| w.1).collect(),
            scatter_to_primary: None,
            rel_error: None,
            kev: None,
            starved: None,
            cpu_seconds: 0.0,
            unit: "1/m",
            scans: Vec::new(),
            files: Vec::new(),
        }
    }

    fn finish(mut self, session: &Session, mut files: Set) -> Result<Outcome, Failure> {
        const LIST: &str = "scan.json";
        if !self.scans.is_empty() {
            self.cpu_seconds = self.scans.iter().map(|s| s.cpu_seconds).sum();
        }
        self.files = files.listed(LIST);
        files.finish(LIST, &self)?;
        session.print(&self, || self.table())?;
        Ok(Outcome::Done)
    }

    /// What a TIFF says of itself.
    fn note(&self, what: &str, scan: &Scan) -> String {
        let facts = self.facts(scan, [0.0; 2]);
        let lines: Vec<String> = facts
            .iter()
            .filter(|f| f.0 != "intrados.range")
            .map(|(name, value)| format!("{name}={value}"))
            .collect();
        format!("intrados.values={what}\n{}\n", lines.join("\n"))
    }

    fn facts(&self, scan: &Scan, [low, high]: [f32; 2]) -> Facts {
        vec![
            ("intrados.version", self.version.into()),
            ("intrados.scene", self.scene.clone()),
            ("intrados.sceneHash", self.scene_hash.clone().unwrap_or_default()),
            ("intrados.seed", self.seed.to_string()),
            ("intrados.member", scan.member.clone()),
            ("intrados.along", scan.along.to_string()),
            ("intrados.projections", self.projections.to_string()),
            ("intrados.corrections", self.corrections.join(" ")),
            ("intrados.keV", format!("{:.1}", scan.kev)),
            ("intrados.nrmse", format!("{:.4}", scan.nrmse)),
            ("intrados.range", format!("black {low:.3} to white {high:.3} 1/m")),
        ]
    }

    fn table(&self) -> String {
        let mut rows = vec![
            [
                "member",
                "along",
                "slices",
                "voxel mm",
                "scatter/primary",
                "nRMSE",
                "porosity",
                "pores",
                "starved",
                "CPU s",
            ]
            .map(String::from)
            .to_vec(),
        ];
        for s in &self.scans {
            rows.push(vec![
                if s.core { format!("{} (core)", s.member) } else { s.member.clone() },
                format!("{:.3}", s.along),
                s.size.map(|n| n.to_string()).join("×"),
                format!("{:.3}", s.voxel_mm),
                format!("{:.3}", s.scatter_to_primary),
                format!("{:.4}", s.nrmse),
                format!("{:.3} %", 100.0 * s.porosity),
                s.pores.to_string(),
                format!("{:.2} %", 100.0 * s.starved),
                format!("{:.1}", s.cpu_seconds),
            ]);
        }
        let mut text = if self.scans.is_empty() { String::new() } else { output::table(&rows) };
        self.files.iter().for_each(|f| text += &format!("file {f}\n"));
        text
    }
}
