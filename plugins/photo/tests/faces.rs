//! Faces of the bundled scenes' members, what pixels show of them, and maps.

#![allow(clippy::unwrap_used, reason = "a test may panic")]

use glam::{DVec3, Vec3};
use intrados_photo::{
    Located, Pick, Pose, PoseError, Prior, Site, face::Chart, locate, picks, taken::Focal, unrolled,
};
use intrados_scene::{Camera, Lens, Scene};
use intrados_stage::{Job, random::Key};

fn column() -> (Scene, Site) {
    let scene = Scene::load_bundled("column", &Job::default()).unwrap();
    let site = Site::new(&scene, &Job::default()).unwrap();
    (scene, site)
}

fn camera(position: Vec3, target: Vec3) -> Camera {
    Camera {
        name: "eye".into(),
        position,
        target,
        up: Vec3::Y,
        fov_deg: 50.0,
        width: 1200,
        height: 900,
        exposure: 0.0,
        lens: Some(Lens { k1: -0.06, ..Lens::default() }),
    }
}

#[test]
fn square_columns_have_four_faces_and_eight_corners_and_round_ones_one_face() {
    let (scene, site) = column();
    for (i, member) in scene.members.iter().enumerate() {
        let surface = site.surface(i).unwrap();
        let names: Vec<&str> = surface.faces.iter().map(|face| face.name.as_str()).collect();
        let corners = surface.outline().corners;
        assert_eq!(corners.len(), 8);
        if member.id == "C3" {
            assert_eq!(names, ["Around"]);
            let Chart::Around(radius) = surface.faces[0].chart else { panic!() };
            assert!((radius - 0.225).abs() < 0.003, "{radius}");
        } else {
            assert_eq!(names.len(), 4, "{names:?}");
            let front = surface.faces.iter().find(|face| face.name == "Front").unwrap();
            assert_eq!(front.chart, Chart::Flat(DVec3::Z));
            assert!(front.across.iter().zip([-0.2, 0.2]).all(|(a, b)| (a - b).abs() < 1e-6));
            assert!(front.along.iter().zip([0.0, 3.0]).all(|(a, b)| (a - b).abs() < 1e-6));
            let at = member.frame.start.as_dvec3();
            for corner in &corners {
                let p = *corner - at;
                assert!((p.x.abs() - 0.2).abs() < 1e-5 && (p.z.abs() - 0.2).abs() < 1e-5);
            }
        }
    }
}

#[test]
fn a_lining_is_seen_from_inside() {
    let scene = Scene::load_bundled("tunnel", &Job::default()).unwrap();
    let site = Site::new(&scene, &Job::default()).unwrap();
    let seen: Vec<_> = scene.cameras.iter().flat_map(|c| site.seen_faces(&Pose::of(c))).collect();
    assert!(!seen.is_empty() && seen.iter().all(|seen| seen.face.name == "Inside"), "{seen:?}");
}

/// Of a round column half or so is looked at, in one piece, wherever the angle begins.
#[test]
fn half_of_a_round_column_is_seen_in_one_piece() {
    let (scene, site) = column();
    let c3 = scene.members.iter().position(|m| m.id == "C3").unwrap();
    for (x, z) in [(-1.9, 1.0), (0.8, -1.7), (-0.5, -0.3), (-1.0, -2.6)] {
        let pose = Pose::of(&camera(Vec3::new(x, 1.5, z), Vec3::new(-1.9, 1.5, -1.7)));
        let seen = site.seen_faces(&pose);
        let seen = seen.iter().find(|seen| seen.member == c3).unwrap();
        let [from, to] = seen.face.across;
        let around = std::f64::consts::TAU * 0.225;
        assert!((0.3..0.65).contains(&((to - from) / around)), "{:?}", seen.face);
    }
}

/// Places on both sides of a seam, right and left as one sees them: what is further to the right in
/// the picture is further across, on each face.
#[test]
fn across_grows_to_the_right_of_who_looks() {
    for (bundled, position, target) in [
        ("column", Vec3::new(3.0, 1.5, 4.0), Vec3::new(1.7, 1.5, 1.3)),
        ("column", Vec3::new(-0.3, 1.5, 1.0), Vec3::new(-1.9, 1.5, -1.7)),
    ] {
        let scene = Scene::load_bundled(bundled, &Job::default()).unwrap();
        let site = Site::new(&scene, &Job::default()).unwrap();
        let pose = Pose::of(&camera(position, target));
        let pixels: Vec<[f64; 2]> = (0..1200).map(|x| [f64::from(x) + 0.5, 450.5]).collect();
        let sights = site.sights(&pose, &pixels);
        let mut compared = 0;
        for pair in sights.windows(2) {
            let [Some(a), Some(b)] = pair else { continue };
            if a.member != b.member || a.face != b.face || a.face.is_none() {
                continue;
            }
            let surface = site.surface(a.member).unwrap();
            let face = &surface.faces[a.face.unwrap()];
            let [from, to] = [a, b].map(|s| surface.on_face(face, s.place)[0]);
            // Around a round column the angle begins again somewhere.
            if (to - from).abs() < 0.1 {
                assert!(to > from, "{from} {to}");
                compared += 1;
            }
        }
        assert!(compared > 100);
    }
}

/// What a pixel shows lies where it is drawn; its millimetres are those from one pixel's place to
/// the next one's; and faces are named.
#[test]
fn a_pixel_knows_its_place_and_its_millimetres() {
    let (scene, site) = column();
    let pose = Pose::of(&camera(Vec3::new(3.0, 1.5, 4.0), Vec3::new(1.7, 1.5, 1.3)));
    let mut compared = 0;
    for k in 0..400 {
        let at = [20.0 + 60.0 * f64::from(k % 20), 20.0 + 43.0 * f64::from(k / 20)];
        let Some(sight) = site.sights(&pose, &[at])[0] else { continue };
        let back = pose.project(sight.place).unwrap();
        assert!((back[0] - at[0]).hypot(back[1] - at[1]) < 0.02, "{at:?} {back:?}");
        let surface = site.surface(sight.member).unwrap();
        let Some(face) = sight.face.map(|face| &surface.faces[face]) else { continue };
        if scene.members[sight.member].id != "C2" || sight.cosine < 0.2 {
            continue;
        }
        for (tangent, mm_px) in surface.tangents(sight.normal).into_iter().zip(sight.mm_px) {
            let moved = pose.project(sight.place + 1e-4 * tangent).unwrap();
            let px = (moved[0] - back[0]).hypot(moved[1] - back[1]);
            assert!((0.1 / px / mm_px - 1.0).abs() < 1e-3, "{mm_px} {}", 0.1 / px);
        }
        let expected = if sight.normal.z > 0.9 { "Front" } else { "Right" };
        assert_eq!(face.name, expected);
        compared += 1;
    }
    assert!(compared > 20, "{compared}");
}

fn located(pose: &Pose, places: &[DVec3], seed: u64) -> Located {
    let noise = |i: usize, k: u32| Key::new(seed, i as u64).normal(2 * k);
    let pick = |(i, place): (usize, &DVec3)| {
        let [x, y] = pose.project(*place).unwrap();
        Pick { pixel: [x + noise(i, 0), y + noise(i, 1)], place: *place }
    };
    let picks: Vec<Pick> = places.iter().enumerate().map(pick).collect();
    let focal = Some(Focal { px: pose.focal_px, rel_error: 0.01 });
    let lens = pose.lens;
    let prior = Prior { size: pose.size, focal, lens, k1_error: 0.0, picking_px: 1.0 };
    locate(&picks, &prior, &|_| true).unwrap()
}

/// Places that pixels show, and their millimetres, scatter over hundreds of noisy poses as stated.
#[test]
fn places_and_millimetres_are_as_wrong_as_they_say() {
    let (scene, site) = column();
    let c2 = scene.members.iter().position(|m| m.id == "C2").unwrap();
    let pose = Pose::of(&camera(Vec3::new(3.8, 1.5, 5.8), Vec3::new(1.7, 1.5, 1.3)));
    let corners = site.surface(c2).unwrap().outline().corners;
    let seen: Vec<DVec3> = corners.into_iter().filter(|p| p.x > 1.6 || p.z > 1.2).collect();
    assert_eq!(seen.len(), 6);
    let pixel = pose.project(DVec3::new(1.75, 1.0, 1.5)).unwrap();
    let truth = site.sights(&pose, &[pixel])[0].unwrap();
    let [around, along] = site.surface(c2).unwrap().tangents(truth.normal);
    let (mut squares, mut count) = ([0.0; 4], 0.0);
    for seed in 0..300 {
        let mut noisy = located(&pose, &seen, 100 + seed);
        noisy.covariance /= noisy.reduced_chi2.max(1.0);
        let Some(sight) = site.sights(&noisy.pose, &[pixel])[0] else { continue };
        let error = site.error(&noisy, &sight).unwrap();
        let off = sight.place - truth.place;
        let z = [
            1e3 * off.dot(around) / error.place_mm[0],
            1e3 * off.dot(along) / error.place_mm[1],
            (sight.mm_px[0] / truth.mm_px[0]).ln() / error.rel_mm_px[0],
            (sight.mm_px[1] / truth.mm_px[1]).ln() / error.rel_mm_px[1],
        ];
        count += 1.0;
        squares.iter_mut().zip(z).for_each(|(s, z)| *s += z * z);
    }
    // The focal length is what it is said to be, exactly, so that errors are a little smaller than
    // stated; 300 squares of N(0, 1) have a mean of 1 ± .08.
    for square in squares {
        let mean = square / count;
        assert!((0.5..1.3).contains(&mean), "{squares:?} of {count}");
    }
}

/// Tables of picks: corners by member and number, places by coordinates; what is wrong is refused
/// with its line.
#[test]
fn picks_are_read_and_bad_ones_refused_with_their_line() {
    let (scene, site) = column();
    let folder = tempfile::tempdir().unwrap();
    let table = folder.path().join("picks.csv");
    let read = |text: &str| {
        std::fs::write(&table, text).unwrap();
        picks::read(&table, &scene, &site).map_err(|error| error.to_string())
    };
    let good = "photo,u,v,x,y,z,member,corner\na.jpg, 10.5,20,,,,C2,1\nb.jpg,3,4,1,2,-3,,\n";
    let good = read(good).unwrap().picked;
    assert!(good[0].pick.place.distance(DVec3::new(1.9, 0.0, 1.5)) < 1e-6);
    assert_eq!(good[0].pick.pixel, [10.5, 20.0]);
    assert_eq!(good[1].pick.place, DVec3::new(1.0, 2.0, -3.0));
    assert_eq!(good[1].photo.as_deref(), Some("b.jpg"));
    assert_eq!(read("\u{feff}u,v,x,y,z\n1,2,3,4,5\n").unwrap().picked.len(), 1);
    for (text, place, word) in [
        ("u,v,member,corner\n1,2,C2,1\n1,2,C9,1\n", ":3: ", "intrados info"),
        ("u,v,member,corner\n1,2,C2,9\n", ":2: ", "--corners C2"),
        ("u,v,member,corner\n1,2,C2,0\n", ":2: ", "8"),
        ("u,v,x,y,z\n1,2,3,4,inf\n", ":2: ", "no number"),
        ("u,v,x,y,z\n1,,3,4,5\n", ":2: ", "v is missing"),
        ("u,v,x,y,z,member,corner\n1,2,3,4,5,C2,1\n", ":2: ", "either"),
        ("u,v,depth\n1,2,3\n", ":1: ", "columns"),
        ("u,v,x,y,z\n1,2,3\n", ":2: ", "table"),
    ] {
        let error = read(text).unwrap_err();
        assert!(error.contains(place) && error.contains(word), "{error}");
    }
}

/// Somebody who sees a face from behind is not admitted.
#[test]
fn picks_that_are_seen_through_concrete_are_refused() {
    let (_, site) = column();
    let front: Vec<DVec3> =
        [[1.5, 0.5], [1.9, 0.5], [1.9, 2.5], [1.5, 2.5]].map(|[x, y]| DVec3::new(x, y, 1.5)).into();
    let picks: Vec<Pick> = front.iter().map(|p| Pick { pixel: [0.0; 2], place: *p }).collect();
    let [before, behind] = [4.5, -0.5].map(|z| {
        let position = Vec3::new(1.7, 1.5, z);
        site.admits(&Pose::of(&camera(position, Vec3::new(1.7, 1.5, 1.3))), &picks)
    });
    assert!(before && !behind);
}

/// Left and right of one face exchanged: that is what somebody would see who stood behind it.
#[test]
fn an_exchanged_face_is_seen_from_behind_and_refused() {
    let (_, site) = column();
    let position = Vec3::new(3.7, 1.65, 5.4);
    let pose = Pose::of(&camera(position, Vec3::new(1.0, 1.4, 0.0)));
    let focal = Some(Focal { px: pose.focal_px, rel_error: 0.03 });
    let prior = Prior { size: pose.size, focal, lens: pose.lens, k1_error: 0.0, picking_px: 1.0 };
    let found = |exchanged: bool| {
        let pick = |[x, y]: [f64; 2]| {
            let seen = if exchanged { 3.4 - x } else { x };
            let pixel = pose.project(DVec3::new(seen, y, 1.5)).unwrap();
            Pick { pixel, place: DVec3::new(x, y, 1.5) }
        };
        let picks = [[1.5, 0.5], [1.9, 0.5], [1.9, 2.5], [1.5, 2.5]].map(pick);
        locate(&picks, &prior, &|pose| site.admits(pose, &picks))
    };
    assert!(found(false).unwrap().pose.position.distance(pose.position) < 1e-3);
    assert_eq!(found(true).unwrap_err(), PoseError::Hidden);
    // What fits nowhere says by how much, admitted or not.
    let any = [[10.0, 20.0], [800.0, 700.0], [30.0, 600.0], [1100.0, 60.0], [500.0, 420.0]];
    let places = [[1.5, 0.5], [1.9, 0.5], [1.9, 2.5], [1.5, 2.5], [1.7, 1.0]];
    let pick = |(pixel, [x, y]): (_, [f64; 2])| Pick { pixel, place: DVec3::new(x, y, 1.5) };
    let picks: Vec<Pick> = any.into_iter().zip(places).map(pick).collect();
    let error = locate(&picks, &prior, &|_| false).unwrap_err().to_string();
    assert!(error.contains("the best leaves"), "{error}");
}

/// A photograph whose colour at each pixel is its place on the front of C2, as far as eight bits
/// go: the map has that colour at that place, and is unknown where another column is in the way.
#[test]
fn a_map_shows_each_place_where_it_is() {
    let (scene, site) = column();
    let pose = Pose::of(&camera(Vec3::new(3.0, 1.5, 4.0), Vec3::new(1.7, 1.5, 1.3)));
    let pixels: Vec<[f64; 2]> = (0..900 * 1200_u32)
        .map(|k| [f64::from(k % 1200) + 0.5, f64::from(k / 1200) + 0.5])
        .collect();
    let c2 = scene.members.iter().position(|m| m.id == "C2").unwrap();
    let sights = site.sights(&pose, &pixels);
    // Stripes of 10 cm along the axis, a ramp across.
    let colour = |s: &Option<intrados_photo::Sight>| match s {
        Some(s) if s.member == c2 => {
            let stripe = if (s.place.y * 10.0).floor() as i64 % 2 == 0 { 40 } else { 200 };
            [stripe, ((s.place.x - 1.5) / 0.4 * 200.0) as u8 + 20, 0]
        }
        _ => [0, 0, 255],
    };
    let picture = image::RgbImage::from_fn(1200, 900, |x, y| {
        image::Rgb(colour(&sights[(y * 1200 + x) as usize]))
    });
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("photo.png");
    picture.save(&path).unwrap();
    let photograph = intrados_photo::Photograph::open(&path).unwrap();
    let surface = site.surface(c2).unwrap();
    let front = surface.faces.iter().find(|face| face.name == "Front").unwrap();
    let map = unrolled(&site, surface, front, (&photograph, &pose), 2.0, &Job::default()).unwrap();
    assert_eq!(map.size, [200, 1500]);
    let (mut right, mut wrong) = (0, 0);
    for (k, light) in map.light.iter().enumerate() {
        let Some(light) = light else { continue };
        let [x, y] = [k % 200, k / 200];
        let height = 3.0 - (y as f64 + 0.5) * 2e-3;
        // Two centimetres about the stripes' edges and the face's may be mixed.
        let from_edge = (height * 10.0 - (height * 10.0).round()).abs() * 0.1;
        if from_edge < 0.01 || !(5..195).contains(&x) {
            continue;
        }
        let stripe = if (height * 10.0).floor() as i64 % 2 == 0 { 40.0 } else { 200.0 };
        let ramp = (x as f32 + 0.5) / 200.0 * 200.0 + 20.0;
        let of = |value: f32| intrados_photo::picture::linear(value / 255.0);
        let is_right = (light.x - of(stripe)).abs() < 0.02 && (light.y - of(ramp)).abs() < 0.03;
        if is_right { right += 1 } else { wrong += 1 }
    }
    assert!(right > 100_000 && wrong * 1000 < right, "{right} right, {wrong} wrong");
    // Some two of its three metres are in the picture; of its back nothing is.
    assert!((0.6..0.75).contains(&map.known()), "{}", map.known());
    let back = surface.faces.iter().find(|face| face.name == "Back").unwrap();
    let none = unrolled(&site, surface, back, (&photograph, &pose), 5.0, &Job::default()).unwrap();
    assert_eq!(none.known(), 0.0);
    assert!(unrolled(&site, surface, back, (&photograph, &pose), 0.01, &Job::default()).is_err());
}
