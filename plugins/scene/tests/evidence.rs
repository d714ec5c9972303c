//! Evidence in files of its own: what becomes of it, what is refused, and that nothing panics.
#![allow(clippy::unwrap_used, reason = "helpers of tests may fall over")]

use std::{fs, path::Path};

use intrados_scene::{
    ErrorKind, LoadError, Scene, Slices,
    structure::{Course, Direction, Electrode, Measures, Observation, Shows, usual},
};
use intrados_stage::Job;

/// A column C1 of 3 m, a beam B1 of 6 m, a tunnel T1 of 20 m, a gauge on the column.
const SCENE: &str = r#"(
    schema: "intrados.scene/1",
    concretes: [
        (name: "old", fck_mpa: 20, density_kg_m3: 2300, hydration: (cement_kg_m3: 230)),
        (name: "grey", fck_mpa: 20),
    ],
    members: [
        (id: "C1", body: Column(section: Rectangle(width_m: 0.4, depth_m: 0.4), height_m: 3), concrete: "old"),
        (id: "B1", body: Beam(section: Rectangle(width_m: 0.3, depth_m: 0.6), length_m: 6), at: (4, 3, 0), concrete: "grey"),
        (id: "T1", body: Tunnel(radius_m: 3, length_m: 20, inner_lining: (thickness_m: 0.3)), at: (30, 0, 0)),
    ],
    gauges: [(name: "SG1", member: "C1", along: 0.5, angle_deg: 0, measures: Strain(Axial))],
    tests: [(name: "truck", member: "C1", actions: [Force(place: Top, force_kn: (0, -100, 0))])],
)"#;

/// A folder with the scene and evidence in it.
struct Place(tempfile::TempDir);

impl Place {
    fn new(body: &str) -> Self {
        let place = Self(tempfile::tempdir().unwrap());
        place.write("scene.ron", SCENE);
        place.write("evidence.ron", evidence(body));
        place
    }

    fn write(&self, name: &str, text: impl AsRef<[u8]>) {
        let path = self.0.path().join(name);
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        fs::write(path, text).unwrap();
    }

    fn load(&self) -> Result<Scene, LoadError> {
        Scene::load(&self.0.path().join("scene.ron"), &Job::default())
    }

    fn observations(&self) -> Vec<Observation> {
        self.load().unwrap().structure.observations.clone()
    }

    /// All that is wrong, without the folder's name.
    fn problems(&self) -> Vec<String> {
        let folder = format!("{}/", self.0.path().display());
        match self.load() {
            Ok(_) => Vec::new(),
            Err(error) => {
                error.problems().iter().map(|p| p.to_string().replace(&folder, "")).collect()
            }
        }
    }
}

fn evidence(body: &str) -> String {
    format!("(\n    schema: \"intrados.evidence/1\",\n    {body}\n)")
}

fn item(fields: &str) -> String {
    format!("items: [(member: \"C1\", name: \"a\", {fields})],")
}

/// A table of C1 with these further fields, and its text.
fn table(fields: &str, text: impl AsRef<[u8]>) -> Place {
    let body = format!("tables: [(file: \"t.csv\", member: \"C1\", name: \"t\", {fields})],");
    let place = Place::new(&body);
    place.write("t.csv", text);
    place
}

#[test]
fn every_kind_becomes_an_observation_with_the_usual_error() {
    let place = Place::new(
        r#"items: [
        (member: "C1", name: "a", date: "2026-05-03", along: 0.4, face: Right, instrument: "meter", shows: Cover(mm: 32)),
        (member: "C1", name: "b", along: (0.2, 0.4), angle_deg: -90, shows: Rebound(number: 38, std_error: 1)),
        (member: "B1", name: "a", along: 0, face: Bottom, shows: Velocity(m_s: 4000)),
        (member: "B1", name: "b", shows: CoreStrength(mpa: 40, diameter_mm: 100, length_mm: 200)),
        (member: "B1", name: "c", shows: HalfCell(mv: -200, electrode: Calomel)),
        (member: "T1", name: "a", face: Crown, shows: Chloride(depths_mm: [5, 15], percent_of_cement: [1, 0.5])),
        (member: "T1", name: "b", shows: Carbonation(mm: 20)),
        (member: "T1", name: "c", shows: Sounding(hollow_m2: 0, tapped_m2: 12)),
        (member: "C1", name: "c", height_m: 1.2, shows: Crack(width_mm: 0.3, course: Map)),
        (member: "C1", name: "d", shows: Spall(area_m2: 0.2, bars_bare: true)),
        (member: "C1", name: "e", shows: Rust(area_m2: 0.1)),
        (member: "C1", name: "f", shows: Efflorescence(area_m2: 0.1)),
        (member: "C1", name: "g", shows: WetSpot(area_m2: 0.1)),
        (member: "C1", name: "h", shows: Intact),
    ],"#,
    );
    let all = place.observations();
    assert_eq!(all.len(), 14);
    let first = &all[0];
    assert_eq!((first.member.as_str(), first.name.as_str()), ("C1", "a"));
    assert_eq!(first.date.unwrap().to_string(), "2026-05-03");
    assert_eq!(first.instrument.as_deref(), Some("meter"));
    assert_eq!((first.spot.along, first.spot.angle_deg), ([0.4, 0.4], Some(90.0)));
    let shows: Vec<&Shows> = all.iter().map(|o| &o.shows).collect();
    assert_eq!(*shows[0], Shows::Cover { mm: 32.0, std_error_mm: 3.2 });
    assert_eq!((all[1].spot.along, all[1].spot.angle_deg), ([0.2, 0.4], Some(270.0)));
    assert_eq!(*shows[1], Shows::Rebound { number: 38.0, std_error: 1.0 });
    assert_eq!((all[2].spot.along, all[2].spot.angle_deg), ([0.0, 0.0], Some(180.0)));
    assert_eq!(*shows[2], Shows::Velocity { m_s: 4000.0, std_error_m_s: 80.0 });
    assert!(matches!(shows[3], Shows::CoreStrength { std_error_mpa: 2.0, .. }));
    // Nobody said where: anywhere.
    assert_eq!((all[3].spot.along, all[3].spot.angle_deg), ([0.0, 1.0], None));
    let electrode = Electrode::Calomel;
    assert_eq!(*shows[4], Shows::HalfCell { mv: -277.0, std_error_mv: 10.0, electrode });
    assert_eq!(all[5].spot.angle_deg, Some(90.0));
    assert!(
        matches!(shows[5], Shows::Chloride { std_error_percent, .. } if (std_error_percent - 0.075).abs() < 1e-12)
    );
    assert_eq!(*shows[6], Shows::Carbonation { mm: 20.0, std_error_mm: 2.0 });
    let width =
        Shows::Crack { width_mm: 0.3, std_error_mm: 0.05, course: Course::Map, length_m: None };
    assert_eq!(*shows[8], width);
    // Of what stands, a height is a place on the axis.
    assert!((all[8].spot.along[0] - 0.4).abs() < 1e-6 && all[8].spot.height_m == Some(1.2));
    assert_eq!(*shows[13], Shows::Intact { seen: 1.0, limit_mm: usual::FOUND_MM });
}

/// By the concrete's own cement, 230 in 2300 kg; where the scene knows none, by 350 in 2400, said.
#[test]
fn chloride_of_concrete_is_counted_as_of_cement() {
    let profile = |member: &str| {
        let body = format!(
            "items: [(member: \"{member}\", name: \"a\", shows: Chloride(depths_mm: [5], percent_of_concrete: [0.1], std_error_percent: 0.01))],"
        );
        Place::new(&body).load().unwrap()
    };
    let of = |scene: &Scene| match &scene.structure.observations[0].shows {
        Shows::Chloride { percent_of_cement, std_error_percent, .. } => {
            [percent_of_cement[0], *std_error_percent]
        }
        other => panic!("{other:?}"),
    };
    let (known, assumed) = (profile("C1"), profile("B1"));
    let near = |a: [f64; 2], b: [f64; 2]| (0..2).all(|k| (a[k] - b[k]).abs() < 1e-9);
    assert!(near(of(&known), [1.0, 0.1]) && near(of(&assumed), [24.0 / 35.0, 2.4 / 35.0]));
    let said = |scene: &Scene| scene.warnings.iter().any(|w| w.contains("350 kg of cement"));
    assert!(!said(&known) && said(&assumed));
}

/// Place and words of the message, for one fault each.
#[test]
fn faults_are_named_with_their_place_and_remedy() {
    let crack = "shows: Crack(width_mm: 0.3, course: Along)";
    for (body, place, words) in [
        ("colour: 1,".into(), "evidence.ron:3:5", "colour"),
        (item("shows: Crack(width_mm: 0.3)"), "evidence.ron:3:", "add `course: …`"),
        (item("shows: Crack(width_mm: 0,3, course: Along)"), "evidence.ron:3:", "write 0.3, not 0,3"),
        (item("shows: Craque(width_mm: 0.3)"), "evidence.ron:3:", "Crack"),
        (item(&format!("along: 1.4, {crack}")), "evidence.ron: items[0].along", "share of the axis"),
        (item(&format!("along: (0.5, 0.3), {crack}")), "evidence.ron: items[0].along", "turn them"),
        (item(&format!("along: \"0.3\", {crack}")), "evidence.ron:3:", "a place on the axis"),
        (item(&format!("date: \"2026-02-30\", {crack}")), "evidence.ron:3:", "no calendar"),
        (item(&format!("date: \"2126-02-03\", {crack}")), "evidence.ron: items[0].date", "the year"),
        (item(&format!("face: Crown, {crack}")), "evidence.ron: items[0].face", "Front, Right, Back or Left"),
        (item(&format!("face: Front, angle_deg: 0, {crack}")), "evidence.ron: items[0].angle_deg", "keep one"),
        (item(&format!("angle_deg: 700, {crack}")), "evidence.ron: items[0].angle_deg", "-360 to 360"),
        (item(&format!("height_m: 9, {crack}")), "evidence.ron: items[0].height_m", "3.00 m tall"),
        (item(&format!("along: 0.9, height_m: 0.3, {crack}")), "evidence.ron: items[0].height_m", "give one of the two"),
        (item(&format!("along: 0.9, {crack}")).replace("C1", "C7"), "evidence.ron: items[0].member", "did you mean \"C1\"?"),
        (item(crack).replace("\"a\"", "\" \""), "evidence.ron: items[0].name", "empty"),
        (format!("items: [(member: \"C1\", name: \"a\", {crack}), (member: \"C1\", name: \"a\", {crack})],"), "evidence.ron: items[1].name", "twice"),
        (item("shows: Cover(mm: 0.032)"), "evidence.ron: items[0].shows.mm", "in mm"),
        (item("shows: Cover(mm: 32, std_error_mm: 0)"), "evidence.ron: items[0].shows.std_error_mm", "above 0"),
        (item("shows: Cover(mm: NaN)"), "evidence.ron: items[0].shows.mm", "outside"),
        (item("shows: Rebound(number: 3)"), "evidence.ron: items[0].shows.number", "10 to 100"),
        (item("shows: Velocity(m_s: 4.2)"), "evidence.ron: items[0].shows.m_s", "write 4200"),
        (item("shows: HalfCell(mv: -0.38)"), "evidence.ron: items[0].shows.mv", "write -380"),
        (item("shows: HalfCell(mv: 380)"), "evidence.ron: items[0].shows.mv", "write -380"),
        (item("shows: CoreStrength(mpa: 4000, diameter_mm: 100, length_mm: 100)"), "evidence.ron: items[0].shows.mpa", "1 to 300"),
        (item("shows: CoreStrength(mpa: 40, diameter_mm: 100, length_mm: 10)"), "evidence.ron: items[0].shows.length_mm", "50 to 500"),
        (item("shows: Chloride(depths_mm: [5, 10], percent_of_cement: [1])"), "evidence.ron: items[0].shows.percent_of_cement", "one value for each"),
        (item("shows: Chloride(depths_mm: [5], percent_of_cement: [1], percent_of_concrete: [1])"), "evidence.ron: items[0].shows.percent_of_concrete", "keep one"),
        (item("shows: Chloride(depths_mm: [10, 5], percent_of_cement: [1, 2])"), "evidence.ron: items[0].shows.depths_mm", "rise"),
        (item("shows: Sounding(hollow_m2: 3, tapped_m2: 2)"), "evidence.ron: items[0].shows.hollow_m2", "between 0"),
        (item("shows: Spall(area_m2: 400)"), "evidence.ron: items[0].shows.area_m2", "surface of C1"),
        (item("shows: Rust(area_m2: 0)"), "evidence.ron: items[0].shows.area_m2", "above 0"),
        ("tables: [(file: \"none.csv\", member: \"C1\", name: \"t\")],".into(), "evidence.ron: tables[0].file: none.csv", "no such file"),
        ("tables: [(file: \"t.csv\", member: \"C1\", name: \"t\", unit: \"kN\")],".into(), "evidence.ron: tables[0].unit", "ue, m/m"),
        ("tables: [(file: \"t.csv\", member: \"C1\", name: \"t\", kind: HalfCell, unit: \"mm\")],".into(), "evidence.ron: tables[0].unit", "mV or V"),
        ("slices: [(member: \"C1\", slices: [])],".into(), "evidence.ron: slices[0].slices", "Files"),
        ("slices: [(member: \"C1\", slices: [Drawn(name: \"d\", count: 1, size: 64, pixel_mm: 1)])],".into(), "evidence.ron: slices[0].slices[0]", "no evidence"),
        ("slices: [(member: \"C1\", slices: [Files(name: \"d\", images: [\"no.tif\"])])],".into(), "evidence.ron: slices[0]: no.tif", "check the path"),
        ("slices: [(member: \"X9Y\", slices: [Files(name: \"d\", images: [\"no.tif\"])])],".into(), "evidence.ron: slices[0].member", "there are \"B1\", \"C1\", \"T1\""),
        ("gauges: [(name: \"SG1\", member: \"C1\", along: 0.5, angle_deg: 0, measures: Strain(Axial))],".into(), "evidence.ron: gauges[0].name", "already"),
        ("gauges: [(name: \"G\", member: \"C1\", along: 5, angle_deg: 0, measures: Strain(Axial))],".into(), "evidence.ron: gauges[0].along", "0 to 1"),
        ("tests: [(name: \"truck\", member: \"C1\", actions: [SelfWeight])],".into(), "evidence.ron: tests[0].name", "already"),
        ("tests: [(name: \"t\", member: \"C1\", actions: [])],".into(), "evidence.ron: tests[0].actions", "nothing acts"),
        ("readings: [(of: \"SG2\", value: 1, std_error: 1)],".into(), "evidence.ron: readings[0].of", "did you mean SG1?"),
        ("readings: [(of: \"SG1\", test: \"bus\", value: 1e-6, std_error: 1e-6)],".into(), "evidence.ron: readings[0].test", "add it to `tests`"),
        ("readings: [(of: \"SG1\", value: 1, std_error: 0)],".into(), "evidence.ron: readings[0].std_error", "above 0"),
    ] {
        let place_of: Place = Place::new(&body);
        let found = place_of.problems();
        let first = found.first().unwrap_or_else(|| panic!("nothing wrong was found in {body}"));
        assert_eq!(found.len(), 1, "{found:?}");
        assert!(
            first.starts_with(place) && first.to_lowercase().contains(&words.to_lowercase()),
            "{body}\n→ {first}\nexpected {place} … {words}"
        );
        assert!(!first.contains('\n'));
    }
}

/// Those of the scene and those of its evidence, and those of all its tables.
#[test]
fn all_problems_are_listed() {
    let place = Place::new(&item("along: 2, shows: Cover(mm: 0.03)"));
    place.write("scene.ron", SCENE.replace("height_m: 3", "height_m: -3"));
    let found = place.problems();
    assert_eq!(found.len(), 3, "{found:?}");
    let members = Place::new(
        "items: [(member: \"X\", name: \"a\", shows: Intact)], gauges: [(name: \"G\", member: \"Y\", along: 0.5, angle_deg: 0, measures: Strain(Axial))],",
    );
    assert_eq!(members.problems().len(), 2, "{:?}", members.problems());
    let rows = table("", "mV,along\n-300,2\nx,0.5\n-200,0.5\n,0.1\n");
    assert_eq!(rows.problems().len(), 2, "{:?}", rows.problems());
}

#[test]
fn gauges_tests_readings_and_slices_join_those_of_the_scene() {
    let place = Place::new(
        "tests: [(name: \"bus\", member: \"B1\", actions: [SelfWeight])], \
         gauges: [(name: \"LV1\", member: \"B1\", along: 0.5, angle_deg: 180, measures: Displacement((0, -1, 0)))], \
         readings: [(of: \"LV1\", test: \"bus\", value: 1e-3, std_error: 1e-5), (of: \"SG1\", test: \"truck\", value: 4e-5, std_error: 1e-6)], \
         slices: [(member: \"C1\", slices: [Files(name: \"core\", images: [\"s_*.png\"], pixel_mm: 0.1, along: 0.5)])],",
    );
    place.write("s_1.png", "a picture that nobody opens yet");
    place.write("s_1_mask-pore.png", "its label");
    let scene = place.load().unwrap();
    assert_eq!([scene.structure.tests.len(), scene.structure.gauges.len()], [2, 2]);
    assert!(matches!(scene.structure.gauges[1].measures, Measures::Displacement(_)));
    assert_eq!(scene.structure.readings.len(), 2);
    let Slices::Files { images, masks, .. } = &scene.members[0].slices[0] else { panic!() };
    assert_eq!([images.len(), masks[0].len()], [1, 1]);
}

/// Whatever wrote the table, the same numbers come out of it.
#[test]
fn tables_of_all_sorts_say_the_same() {
    for text in [
        "along,mV,face\n0.25,-310,Front\n0.75,-120.5,Back\n",
        "\u{feff}along;mV;face\r\n0,25;-310;front\r\n0,75;-120,5;back\r\n",
        "along\tmv\tFACE\n0.25\t-310\tFRONT\n\n0,75\t\u{2212}120,5\tBack",
        "\n along , mV , face \n\n 0.25 , -310 , Front \n , , \n\"0.75\",-120.5,Back\n",
    ] {
        let all = table("date: \"2026-05-03\",", text).observations();
        assert_eq!(all.len(), 2, "{text}");
        let told: Vec<_> = all
            .iter()
            .map(|o| match o.shows {
                Shows::HalfCell { mv, .. } => {
                    (o.name.as_str(), o.spot.along[0], o.spot.angle_deg, mv)
                }
                _ => panic!("{o:?}"),
            })
            .collect();
        let right = [("t 1", 0.25, Some(0.0), -310.0), ("t 2", 0.75, Some(180.0), -120.5)];
        assert_eq!(told, right, "{text}");
        assert!(all.iter().all(|o| o.date.is_some()));
    }
}

#[test]
fn tables_of_every_kind_are_read() {
    let first = |fields: &str, text: &str| table(fields, text).observations()[0].shows.clone();
    assert_eq!(
        first("", "cover_mm,std_error\n30,2.5\n"),
        Shows::Cover { mm: 30.0, std_error_mm: 2.5 }
    );
    assert_eq!(
        first("unit: \"mm\",", "cover_mm\n40\n"),
        Shows::Cover { mm: 40.0, std_error_mm: 4.0 }
    );
    assert_eq!(first("", "rebound\n40\n"), Shows::Rebound { number: 40.0, std_error: 2.0 });
    let pulse = Shows::Velocity { m_s: 4100.0, std_error_m_s: 82.0 };
    assert_eq!(first("", "velocity_m_s\n4100\n"), pulse);
    assert_eq!(first("kind: Velocity, unit: \"km/s\",", "value\n4.1\n"), pulse);
    assert_eq!(first("", "carbonation_mm\n0\n"), Shows::Carbonation { mm: 0.0, std_error_mm: 1.0 });
    let cell = first(
        "kind: HalfCell, unit: \"V\", electrode: SilverChloride,",
        "value,std_error\n-0.2,0.01\n",
    );
    let electrode = Electrode::SilverChloride;
    assert_eq!(cell, Shows::HalfCell { mv: -321.0, std_error_mv: 10.0, electrode });
    // A profile a place.
    let text = "along,depth_mm,chloride_percent_cement\n0.1,5,1\n0.1,15,0.5\n0.6,5,0.8\n";
    let profiles = table("", text).observations();
    assert_eq!(profiles.iter().map(|o| o.name.as_str()).collect::<Vec<_>>(), ["t 1", "t 2"]);
    assert!(
        matches!(&profiles[0].shows, Shows::Chloride { depths_mm, .. } if *depths_mm == [5.0, 15.0])
    );
}

/// An error has its own unit where its header says one, else that of its value.
#[test]
fn an_error_has_its_own_unit() {
    let first = |fields: &str, text: &str| table(fields, text).observations()[0].shows.clone();
    let cover = |mm: f64, std_error_mm: f64| Shows::Cover { mm, std_error_mm };
    for (text, right) in [
        ("cover [cm],std_error\n3.5,0.2\n", cover(35.0, 2.0)),
        ("cover [cm],std_error [mm]\n3.5,2\n", cover(35.0, 2.0)),
        ("cover [mm],std_error [cm]\n35,0.2\n", cover(35.0, 2.0)),
        ("cover_mm,std_error\n,mm\n35,2\n", cover(35.0, 2.0)),
    ] {
        assert_eq!(first("", text), right, "{text}");
    }
    let cells = "value,std_error [mV]\n-0.32,15\n";
    let volts = first("kind: HalfCell, unit: \"V\",", cells);
    assert!(matches!(volts, Shows::HalfCell { std_error_mv, .. } if std_error_mv == 15.0));
    let gauge = table("unit: \"ue\",", "gauge,value,std_error [m/m]\nSG1,100,3e-6\n");
    assert!((gauge.load().unwrap().structure.readings[0].std_error - 3e-6).abs() < 1e-18);
    let wrong = table("", "cover_mm,std_error [mV]\n35,2\n").problems();
    assert!(wrong[0].contains("mV is no unit of std_error"), "{wrong:?}");
}

/// A grid's kind is given, or told by its units, or by values that only potentials have.
#[test]
fn a_grid_is_of_its_kind() {
    let all = |fields: &str, text: &str| -> Vec<Shows> {
        table(fields, text).observations().into_iter().map(|o| o.shows).collect()
    };
    let covers = "height_m,0.25,0.5\n0.5,35,40\n1,30,38\n";
    let found = all("kind: Cover,", covers);
    assert_eq!(found.len(), 4);
    assert_eq!(found[1], Shows::Cover { mm: 40.0, std_error_mm: 4.0 });
    let wrong = table("", covers).problems();
    assert!(wrong[0].contains("nothing says what the grid holds"), "{wrong:?}");
    // Its row of units may say it, m being that of places.
    let electrode = Electrode::CopperSulphate;
    let cell = Shows::HalfCell { mv: -320.0, std_error_mv: 15.0, electrode };
    for text in [
        "height_m,0.25,0.5,std_error\n0.5,-320,-310,15\n",
        "height_m,0.25,0.5,std_error\nm,mV,mV,mV\n0.5,-320,-310,15\n",
        "height_m,0.25 [m],0.5 [m],std_error [mV]\nm,V,V,\n0.5,-0.32,-0.31,15\n",
    ] {
        assert_eq!(all("", text)[0], cell, "{text}");
    }
    let centimetres = all("kind: Cover,", "height_m,0.25\nm,cm\n0.5,3.5\n");
    assert_eq!(centimetres, [Shows::Cover { mm: 35.0, std_error_mm: 3.5 }]);
    for (fields, text, said) in [
        ("", "height_m,0.25\nm,mm\n0.5,35\n", "nothing says what the grid holds"),
        ("kind: Cover,", "height_m,0.25\nm,mV\n0.5,35\n", "in mm or cm"),
        ("", "height_m,0.25,0.5\nm,mV,V\n0.5,-320,-.31\n", "give them one unit"),
        ("kind: HalfCell, unit: \"V\",", "height_m,0.25\nm,mV\n0.5,-320\n", "correct one of them"),
    ] {
        let wrong = table(fields, text).problems();
        assert!(wrong.iter().any(|line| line.contains(said)), "{text}: {wrong:?}");
    }
}

/// A profile is of its place, however its rows stand; a row of no place where others have one is
/// not taken for the whole member's.
#[test]
fn rows_belong_to_their_places() {
    let by_depth = "along,depth_mm,chloride_percent_cement\n\
                    0.1,5,1\n0.6,5,0.8\n0.10,15,0.5\n0.60,15,0.4\n";
    let profiles = table("", by_depth).observations();
    assert_eq!(profiles.len(), 2);
    assert!(
        matches!(&profiles[1].shows, Shows::Chloride { depths_mm, .. } if *depths_mm == [5.0, 15.0])
    );
    let merged = "along,cover_mm\n0.1,35\n,30\n";
    let wrong = table("", merged).problems();
    assert!(wrong[0].contains("t.csv:3: column along") && wrong[0].contains("merged"), "{wrong:?}");
    assert_eq!(table("confirmed: true,", merged).observations().len(), 2);
    // Where nobody says a place, all are the member's.
    assert_eq!(table("", "along,cover_mm\n,35\n,30\n").observations().len(), 2);
}

#[test]
fn gauges_are_read_in_their_units() {
    let text = "gauge;value;std_error\nSG1;41,5;1\n";
    let readings = |fields: &str| table(fields, text).load().unwrap().structure.readings.clone();
    let micro = &readings("unit: \"ue\", test: \"truck\",")[0];
    assert!((micro.value - 41.5e-6).abs() < 1e-18 && (micro.std_error - 1e-6).abs() < 1e-18);
    assert_eq!((micro.of.as_str(), micro.test.as_deref()), ("SG1", Some("truck")));
    assert_eq!(readings("unit: \"µε\",")[0].value, micro.value);
    let plain = table("unit: \"ue\",", "gauge,value\nSG1,100\n").load().unwrap();
    assert!((plain.structure.readings[0].std_error - 2e-6).abs() < 1e-18);
}

/// A table of strains and movements says the unit of each row; what it does not say is said of all.
#[test]
fn a_column_of_units_is_read_row_by_row() {
    let text = "gauge,value,unit,std_error,along,face\nSG1,41.5,µε,1,,\nSG1,1e-5,m/m,,,\n\
                LV1,-1.5,mm,0.1,0.5,Front\n";
    let readings = table("", text).load().unwrap().structure.readings.clone();
    let near = |a: f64, b: f64| (a / b - 1.0).abs() < 1e-9;
    let expected = [(41.5e-6, 1e-6), (1e-5, 1e-6), (-1.5e-3, 1e-4)];
    for (reading, (value, error)) in readings.iter().zip(expected) {
        assert!(near(reading.value, value) && near(reading.std_error, error), "{reading:?}");
    }
    assert_eq!(readings.len(), 3);
    let of_all = table("unit: \"ue\",", "gauge,value,unit\nSG1,5,\nSG1,6,με\n");
    assert_eq!(of_all.load().unwrap().structure.readings.len(), 2);
    let shows = |fields: &str, text: &str| -> Vec<Shows> {
        table(fields, text).observations().into_iter().map(|o| o.shows).collect()
    };
    let covers = shows("kind: Cover,", "value,unit\n3.2,cm\n35,mm\n");
    assert_eq!(covers, shows("", "cover_mm,unit\n32,mm\n35,\n"));
    assert_eq!(shows("kind: Rebound,", "value,unit\n38,\n"), shows("", "rebound\n38\n"));
    let chloride = "depth_mm,chloride_percent_cement,unit\n5,1,%\n15,0.5,% of cement\n";
    let profile = table("", chloride).observations();
    assert_eq!(profile.iter().map(|o| o.name.as_str()).collect::<Vec<_>>(), ["t 1"]);
}

/// Where a gauge is may be said in its table; then nobody need define it elsewhere.
#[test]
fn gauges_are_defined_by_the_places_of_their_readings() {
    let text = "gauge,value,along,face,angle_deg,depth_mm\nLV1,-1.5,0.5,Right,,\n\
                LV2,0.2,0.25,,-90,40\nLV1,-1.6,,,,\n";
    let scene = table("unit: \"mm\",", text).load().unwrap();
    let gauges = &scene.structure.gauges;
    let places: Vec<_> = gauges.iter().map(|g| (g.along, g.angle_deg, g.depth_mm)).collect();
    assert_eq!(places, [(0.5, 0.0, 0.0), (0.5, 90.0, 0.0), (0.25, 270.0, 40.0)]);
    let upwards = |m: &Measures| matches!(m, Measures::Displacement(way) if way.y == 1.0);
    assert!(gauges[1..].iter().all(|g| g.member == "C1" && upwards(&g.measures)));
    assert_eq!(scene.structure.readings.len(), 3);
    // A known one may be named with its place, rounded as people round.
    let known = table("unit: \"ue\",", "gauge,value,along,face\nSG1,5,0.5004,Front\n");
    assert_eq!(known.load().unwrap().structure.gauges.len(), 1);
    // The side of all is said once.
    let all = table("face: Back, unit: \"m/m\",", "gauge,value,along\nSG2,1e-5,0.1\n");
    let gauge = &all.load().unwrap().structure.gauges[1];
    assert_eq!((gauge.angle_deg, &gauge.measures), (180.0, &Measures::Strain(Direction::Axial)));
    for (unit, rows, place, words) in [
        (
            "ue",
            "SG1,5,0.7,90,",
            "along",
            "at along 0.5, 0°, 0 mm deep already, not at along 0.7, 90°",
        ),
        ("ue", "SG1,5,0.5,,30", "along", "not at along 0.5, 0°, 30 mm deep"),
        ("ue", "SG2,5,0.7,90,\nSG2,6,0.7,120,", "along", "not at along 0.7, 120°"),
        ("ue", "SG2,5,0.7,,", "gauge", "say it in a column face or angle_deg"),
        ("ue", "SG2,5,,90,", "along", "how far along"),
        ("ue", "SG2,5,70,90,", "along", "share of the axis"),
        ("ue", "SG2,5,0.7,900,", "angle_deg", "-360 to 360"),
        ("ue", "SG2,5,0.7,90,-5", "depth_mm", "0 to 10000"),
        ("MPa", "PC1,5,0.7,90,", "gauge", "needs its direction: add it to `gauges`"),
        ("mm", "SG1,5,0.5,0,", "value", "ue or m/m"),
    ] {
        let unit = format!("unit: \"{unit}\",");
        let text = format!("gauge,value,along,angle_deg,depth_mm\n{rows}\n");
        let found = table(&unit, &text).problems();
        let line = format!("t.csv:{}: column {place}", rows.lines().count() + 1);
        assert_eq!(found.len(), 1, "{rows}: {found:?}");
        assert!(found[0].starts_with(&line) && found[0].contains(words), "{rows}: {}", found[0]);
    }
    let crown = table("face: Crown, unit: \"ue\",", "gauge,value,along\nSG2,1,0.1\n");
    assert!(crown.problems()[0].starts_with("t.csv:2: column face"), "{:?}", crown.problems());
}

/// File, line, column and what to do.
#[test]
fn faults_of_tables_are_named_with_line_and_column() {
    let utf16: Vec<u8> = "mV\n1\n".encode_utf16().flat_map(u16::to_le_bytes).collect();
    let utf16 = [&[0xff, 0xfe][..], &utf16].concat();
    for (fields, text, place, words) in [
        ("", b"" as &[u8], "t.csv", "is empty"),
        ("", b"mV\n", "t.csv", "no rows"),
        ("", &utf16, "t.csv:2: column mV", "hardly a potential"),
        ("", b"mV\n\xb5\n", "t.csv:2: column mV", "no number"),
        ("", b"PK\x03\x04\x00\x00", "t.csv", "UTF-8"),
        ("", b"along,mW\n0.1,-300\n", "t.csv:1", "did you mean mV?"),
        ("", b"along,cover\n0.1,30\n", "t.csv:1", "cover_mm"),
        ("", b"along,potential\n0.1,30\n", "t.csv:1", "in mV"),
        ("", b"along,quality of the weather\n0.1,30\n", "t.csv:1", "is not known here"),
        ("", b"along,face\n0.1,Front\n", "t.csv:1", "what was measured"),
        ("", b"mV,cover_mm\n-300,30\n", "t.csv:1", "more than one"),
        ("", b"mV,mV\n-300,30\n", "t.csv:1", "twice"),
        ("", b"along,value\n0.1,30\n", "t.csv:1", "kind and unit"),
        ("", b"gauge,value\nSG1,30\n", "t.csv:1", "in which unit"),
        ("", b"chloride_percent_cement\n0.5\n", "t.csv:1", "depth_mm"),
        ("", b"mV,depth_mm\n-300,5\n", "t.csv:1", "take it out"),
        (
            "unit: \"ue\",",
            b"gauge,value,height_m\nSG1,5,0.5\n",
            "t.csv:1",
            "along with face or angle_deg",
        ),
        ("unit: \"ue\",", b"gauge,value,face\nSG1,5,Front\n", "t.csv:1", "add the column along"),
        ("face: Front, unit: \"ue\",", b"gauge,value\nSG1,5\n", "t.csv:1", "columns of the table"),
        ("unit: \"mm\",", b"mV\n-300\n", "t.csv:1", "unit does not fit"),
        ("unit: \"mV\",", b"gauge,value\nSG1,5\n", "t.csv:1", "no unit of a gauge"),
        ("kind: Cover, unit: \"mm\",", b"mV\n-300\n", "t.csv:1", "kind does not fit"),
        ("electrode: Calomel,", b"rebound\n30\n", "t.csv:1", "electrode does not fit"),
        ("along: 0.5, unit: \"ue\",", b"gauge,value\nSG1,5\n", "t.csv:1", "where they are defined"),
        (
            "",
            b"gauge,value,unit\nSG1,5,ue\nSG1,5,kN\n",
            "t.csv:3: column unit",
            "give the unit ue, m/m",
        ),
        ("", b"gauge,value,unit\nSG1,5,ue\nSG1,5,\n", "t.csv:3: column unit", "in which unit"),
        ("", b"gauge,value,unit\nSG1,5,ue\nSG1,5,mm\n", "t.csv:3: column value", "ue or m/m"),
        ("", b"gauge,value,unit\nSG1,41,m/m\n", "t.csv:2: column value", "in ue?"),
        ("", b"gauge,value,units\nSG1,5,ue\n", "t.csv:1", "did you mean unit?"),
        (
            "unit: \"ue\",",
            b"gauge,value,unit\nSG1,1e-5,m/m\n",
            "t.csv:2: column unit",
            "ue is given for the whole table",
        ),
        ("kind: Cover,", b"value,unit\n30,mm\n30,V\n", "t.csv:3: column unit", "in mm or cm"),
        ("kind: Cover,", b"value,unit\n30,mm\n30,\n", "t.csv:3: column unit", "in mm or cm"),
        ("kind: Cover,", b"value\n30\n", "t.csv:1", "in mm or cm"),
        ("kind: Rebound,", b"value,unit\n30,R\n", "t.csv:2: column unit", "has no unit"),
        ("", b"mV,unit\n-0.3,V\n", "t.csv:2: column unit", "has its unit in its name"),
        (
            "",
            b"depth_mm,chloride_percent_cement,unit\n5,1,kg/m3\n",
            "t.csv:2: column unit",
            "has its unit in its name",
        ),
        ("", b"along,mV\n0.1,-300\n\n\n0.2,abc\n", "t.csv:5: column mV", "is no number"),
        (
            "",
            b"along;mV\n0,1;-1.300\n0,2;-310,5\n0,3;-310.5\n",
            "t.csv: column mV",
            "all in one way",
        ),
        ("", b"along,mV\n0,1,-300,5\n", "t.csv:2", "decimal comma"),
        ("", b"along,mV\n0.1,\n", "t.csv:2: column mV", "is empty"),
        ("", b"along,mV\n0.1,-300\n40,-300\n", "t.csv:3: column along", "share of the axis"),
        ("", b"mV\n-0.3\n", "t.csv:2: column mV", "write -300"),
        ("", b"mV\nNaN\n", "t.csv:2: column mV", "is no number"),
        ("", b"mV,std_error\n-300,-1\n", "t.csv:2: column std_error", "above 0"),
        ("", b"mV,face\n-300,Upside\n", "t.csv:2: column face", "is no face"),
        ("", b"mV,face\n-300,Crown\n", "t.csv:2: column face", "Front, Right"),
        ("", b"mV,date\n-300,3/5/2026\n", "t.csv", "date"),
        ("", b"depth_mm,chloride_percent_cement\n15,1\n5,2\n", "t.csv:2: column depth_mm", "rise"),
        ("unit: \"ue\",", b"gauge,value\nSG7,5\n", "t.csv:2: column gauge", "did you mean SG1?"),
        ("unit: \"ue\",", b"gauge,value\nLV1,5\n", "t.csv:2: column gauge", "in columns along"),
        ("unit: \"mm\",", b"gauge,value\nSG1,5\n", "t.csv:2: column value", "ue or m/m"),
        ("unit: \"ue\",", b"gauge,value,test\nSG1,5,bus\n", "t.csv:2: column test", "add it"),
        (
            "unit: \"ue\",",
            b"gauge,value,std_error\nSG1,5,0\n",
            "t.csv:2: column std_error",
            "above 0",
        ),
    ] {
        let found = table(fields, text).problems();
        let said = String::from_utf8_lossy(text).into_owned();
        let first = found.first().unwrap_or_else(|| panic!("nothing wrong was found in {said}"));
        assert_eq!(found.len(), 1, "{said}: {found:?}");
        assert!(
            first.starts_with(place) && first.contains(words),
            "{said}\n→ {first}\nexpected {place} … {words}"
        );
        assert!(!first.contains('\n'));
    }
    let rows = format!("mV\n{}", "-300\n".repeat(200_001));
    assert!(table("", rows).problems()[0].contains("more than 200000 rows"));
    let bytes = vec![b'\n'; (16 << 20) + 1];
    assert!(table("", bytes).problems()[0].contains("longer than 16 MiB"));
    // Of a member that is not there its rows say nothing more.
    let nobody = "tables: [(file: \"t.csv\", member: \"X\", name: \"t\")],";
    let place = Place::new(nobody);
    place.write("t.csv", "mV\n-300\n-200\n");
    assert_eq!(place.problems().len(), 1, "{:?}", place.problems());
    // Another member's gauge.
    let other = "tables: [(file: \"t.csv\", member: \"B1\", name: \"t\", unit: \"ue\")],";
    let place = Place::new(other);
    place.write("t.csv", "gauge,value\nSG1,5\n");
    assert!(place.problems()[0].contains("SG1 is on C1, not on B1"), "{:?}", place.problems());
}

#[test]
fn photographs_come_with_their_picks() {
    let photo = |fields: &str| {
        format!("photographs: [(file: \"p.jpg\", picks: \"p.csv\", name: \"front\", {fields})],")
    };
    let place = Place::new(&photo("member: \"C1\", date: \"2026-05-03\", picking_px: 4"));
    assert!(place.problems()[0].contains("photographs[0].file"), "{:?}", place.problems());
    place.write("p.jpg", "a picture that nobody opens yet");
    assert!(place.problems()[0].contains("photographs[0].picks"), "{:?}", place.problems());
    place.write("p.csv", "u,v,x,y,z\n");
    let scene = place.load().unwrap();
    let [read] = &scene.structure.photographs[..] else { panic!("one photograph") };
    assert_eq!((read.member.as_str(), read.name.as_str(), read.picking_px), ("C1", "front", 4.0));
    assert!(read.file.ends_with("p.jpg") && read.picks.ends_with("p.csv"));
    assert_eq!(read.shadow_error_m, 0.02);
    // What they hold is part of the scene.
    place.write("p.jpg", "another picture");
    assert_ne!(place.load().unwrap().hash, scene.hash);
    for (fields, said) in [
        ("member: \"X9\"", "X9"),
        ("member: \"C1\", picking_px: 0", "picking_px"),
        ("member: \"C1\", focal_px: 2", "focal_px"),
        ("member: \"C1\", shadow_error_mm: -1", "shadow_error_mm"),
    ] {
        place.write("evidence.ron", evidence(&photo(fields)));
        assert!(place.problems()[0].contains(said), "{fields}: {:?}", place.problems());
    }
}

#[test]
fn the_hash_covers_evidence_and_its_tables() {
    let place = table("", "mV\n-300\n");
    let before = place.load().unwrap().hash;
    assert_eq!(place.load().unwrap().hash, before);
    place.write("t.csv", "mV\n-301\n");
    let table = place.load().unwrap().hash;
    place.write("evidence.ron", evidence(""));
    let file = place.load().unwrap().hash;
    fs::remove_file(place.0.path().join("evidence.ron")).unwrap();
    let none = place.load().unwrap().hash;
    let all = [before, table, file, none];
    assert!((0..4).all(|i| (0..i).all(|k| all[i] != all[k])), "{all:?}");
}

/// Named files are read in their order, before the one beside; their paths are their own.
#[test]
fn evidence_may_be_named_and_lie_elsewhere() {
    let place = Place::new(&item("shows: Intact"));
    place.write("scene.ron", SCENE.replace("gauges:", "evidence: [\"2025/a.ron\"], gauges:"));
    place.write(
        "2025/a.ron",
        evidence("tables: [(file: \"t.csv\", member: \"C1\", name: \"old\")],"),
    );
    place.write("2025/t.csv", "cover_mm\n30\n");
    let names: Vec<_> = place.observations().into_iter().map(|o| o.name).collect();
    assert_eq!(names, ["old 1", "a"]);
    // Names count over all files.
    place.write("evidence.ron", evidence(&item("shows: Intact").replace("\"a\"", "\"old 1\"")));
    assert!(place.problems()[0].contains("twice"), "{:?}", place.problems());
    place.write("scene.ron", SCENE.replace("gauges:", "evidence: [\"2024/a.ron\"], gauges:"));
    assert_eq!(place.load().unwrap_err().kind(), ErrorKind::NoInput);
    let far = tempfile::tempdir().unwrap();
    fs::write(far.path().join("a.ron"), evidence("")).unwrap();
    let named = format!("evidence: [{:?}], gauges:", far.path().join("a.ron"));
    place.write("scene.ron", SCENE.replace("gauges:", &named));
    assert!(place.problems()[0].contains("--allow"), "{:?}", place.problems());
}

#[test]
fn evidence_opened_as_a_scene_says_so() {
    let place = Place::new("");
    let path = place.0.path().join("evidence.ron");
    let error = Scene::load(&path, &Job::default()).unwrap_err().to_string();
    assert!(error.contains("is evidence and no scene"), "{error}");
    // A bundled scene has none, whatever lies where the program runs.
    assert!(Scene::open(Path::new("column"), &Job::default()).is_ok());
}

/// Bytes changed, cut and doubled: an error or a scene, never a panic, and one line each.
#[test]
fn damaged_evidence_and_tables_never_panic() {
    let good = evidence(
        "items: [(member: \"C1\", name: \"a\", along: (0.2, 0.3), face: Front, date: \"2026-05-03\", shows: Crack(width_mm: 0.3, course: Along))], \
         tables: [(file: \"t.csv\", member: \"C1\", name: \"t\")],",
    );
    let rows = "along;depth_mm;chloride_percent_cement;face;date\n0,1;5;1;Front;2026-05-03\n0,1;15;0,5;Front;2026-05-03\n";
    let place = Place::new("");
    let mut state = 1_u64;
    let mut next = |n: usize| {
        state =
            state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 33) as usize % n.max(1)
    };
    let mut damage = |bytes: &[u8]| {
        let mut bytes = bytes.to_vec();
        for _ in 0..=next(3) {
            let (at, other) = (next(bytes.len()), next(bytes.len()));
            match next(4) {
                0 if !bytes.is_empty() => bytes[at] = next(256) as u8,
                1 => bytes.truncate(at),
                2 => bytes.insert(at, b"();,.\"-\n\r\t\xff0"[next(12)]),
                _ => {
                    let part = bytes[at.min(other)..at.max(other)].to_vec();
                    bytes.splice(at..at, part);
                }
            }
        }
        bytes
    };
    for i in 0..600 {
        let texts = [good.as_bytes(), rows.as_bytes()];
        let [file, table] =
            [0, 1].map(|k| if i % 2 == k { damage(texts[k]) } else { texts[k].to_vec() });
        place.write("evidence.ron", &file);
        place.write("t.csv", &table);
        for problem in place.problems() {
            assert!(!problem.contains('\n') && problem.len() < 1000, "{problem}");
        }
    }
}
