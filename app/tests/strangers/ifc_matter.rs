//! What IFC elements are made of, what their numbers mean, and their bars. Read by IfcOpenShell.

use std::{fs, path::Path};

use intrados_scene::{Part, Scene};
use intrados_stage::Job;
use serde_json::Value;

use super::{hostile, run, said};

/// What came of an import.
struct Import {
    report: Value,
    /// What it says on standard error, and the record's remarks.
    notes: String,
    text: String,
    scene: Scene,
}

impl Import {
    fn of(path: &Path) -> Self {
        let folder = tempfile::tempdir().unwrap();
        let out = folder.path().join("out");
        let (file, out_text) = (path.to_str().unwrap(), out.to_str().unwrap());
        let output = run(&["import", file, "--out", out_text, "--format", "json"]);
        assert!(output.status.success(), "{file}: {}", said(&output));
        let place = out.join("scene.ron");
        Self {
            report: serde_json::from_slice(&output.stdout).unwrap(),
            notes: String::from_utf8_lossy(&output.stderr).into_owned(),
            text: fs::read_to_string(&place).unwrap(),
            scene: Scene::load(&place, &Job::default()).unwrap(),
        }
    }

    fn public(name: &str) -> Self {
        Self::of(&hostile(&format!("public/ifc/{name}.ifc")))
    }

    fn written(text: &str) -> Self {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("model.ifc");
        fs::write(&path, text).unwrap();
        Self::of(&path)
    }

    fn number(&self, field: &str) -> u64 {
        self.report[field].as_u64().unwrap()
    }

    /// All of `words` are in scene.ron, in the list of materials, or among the notes.
    fn says(&self, name: &str, words: &[&str]) {
        let all = format!("{}\n{}\n{}", self.text, self.report["materials"], self.notes);
        for word in words {
            assert!(all.contains(word), "{name}: \"{word}\" is not in\n{all}");
        }
    }

    /// Lines of steel in members: part, diameter in mm, length in m.
    fn steel(&self) -> Vec<(Part, f64, f64)> {
        let lines = self.scene.structure.assemblies.iter().flat_map(|a| &a.steel);
        lines
            .map(|line| {
                let length: f32 = line.line.windows(2).map(|w| w[0].distance(w[1])).sum();
                (line.part, (1e4 * f64::from(line.diameter)).round() / 10.0, f64::from(length))
            })
            .collect()
    }
}

/// Doubts are those notes that a plain file does not have. That members of a model without a
/// foundation rest on nothing is no doubt about what they are made of.
fn is_doubted(import: &Import) -> bool {
    let notes = import.report["notes"].as_array().unwrap();
    notes.iter().any(|note| !note.as_str().unwrap().contains("rests on nothing"))
}

/// File, what scene.ron or the list of materials says, whether there is a note.
const MATTER: [(&str, &[&str], bool); 47] = [
    ("girder_S355J2", &["matter:", "strength_mpa: 355", "steel, 355 MPa"], true),
    ("girder_S235JR", &["matter:", "strength_mpa: 235", "steel, 235 MPa"], true),
    ("girder_STEEL_S355", &["matter:", "strength_mpa: 355"], true),
    ("girder_S355_category", &["matter:", "strength_mpa: 355"], true),
    ("mat_S355", &["matter:", "strength_mpa: 355"], true),
    ("mat_Steel_C30", &["matter:", "strength_mpa: 235"], true),
    ("mat_wood_C24", &["matter:", "strength_mpa: 24", "timber, 24 MPa"], true),
    ("mat_wood_C30", &["matter:", "strength_mpa: 30", "timber, 30 MPa"], true),
    ("mat_4000psi", &["fck_mpa: 27.58", "4000 psi"], false),
    ("mat_5ksi", &["fck_mpa: 34.47", "5 ksi"], false),
    ("mat_B25_russian", &["concrete: \"C20/25\"", "class B25 of GOST 26633, of cubes"], false),
    ("mat_B300", &["fck_mpa: 18.3", "an old mark"], true),
    ("mat_C3545", &["concrete: \"C35/45\""], false),
    ("mat_C35_45_spaces", &["concrete: \"C35/45\""], false),
    ("mat_C40_chinese", &["concrete: \"C32/40\"", "the lower is taken"], true),
    ("mat_Fc24_japan", &["fck_mpa: 24"], false),
    ("mat_LC30", &["concrete: \"C30/33\"", "density_kg_m3: 1900", "lightweight"], true),
    ("mat_M30_indian", &["concrete: \"C25/30\"", "IS 456"], false),
    ("mat_Rebar_B500", &["concrete: \"C30/37\""], false),
    ("strength_cube", &["concrete: \"C30/37\"", "37 MPa", "on cubes"], false),
    ("strength_MPa", &["concrete: \"C30/37\""], false),
    ("strength_Pa", &["concrete: \"C30/37\""], false),
    ("strength_kPa", &["concrete: \"C30/37\""], false),
    ("cover_mm", &["cover_mm: 35,"], false),
    ("cover_foot", &["cover_mm: 35.1,"], false),
    ("cover_m_35real", &["cover_mm: 35,", "35 mm is taken"], true),
    ("cover_mm_in_m", &["cover_mm: 35,", "0.035 m is taken"], true),
    ("cover_own_unit_cm", &["cover_mm: 45,"], false),
    ("cover_own_unit_cm12", &["cover_mm: 60,"], false),
    ("cover_text", &["cover_mm: 35,"], false),
    ("exp_aci", &["class: \"XC4\"", "\"S2\" is no class of EN 206"], true),
    ("exp_lower", &["class: \"XC4, XD1\""], false),
    ("exp_slash", &["class: \"XC4, XD1, XF2\""], false),
    ("exp_space", &["class: \"XC4, XD3\""], false),
    ("exp_ws", &["class: \"XC4, XD3\""], false),
    ("plain_mm", &["(IfcColumn): 4.00 m, 0.40 by 0.40 m"], false),
    ("plain_metre", &["(IfcColumn): 4.00 m, 0.40 by 0.40 m"], false),
    ("plain_inch", &["(IfcColumn): 4.00 m, 0.40 by 0.40 m"], false),
    ("plain_foot", &["(IfcColumn): 4.00 m, 0.40 by 0.40 m"], false),
    ("survey_foot", &["(IfcColumn): 4.00 m, 0.40 by 0.40 m"], false),
    (
        "two_length_units",
        &["(IfcColumn): 4.00 m, 0.40 by 0.40 m", "several units of length", "milli metre is used"],
        true,
    ),
    ("year_text", &["\"ca. 1968/1970\": 1968 is taken", "concrete: \"C20/25\""], true),
    ("year_refurb", &["concrete: \"C20/25\""], false),
    ("tendon_1500kN", &["Girder"], false),
    ("tendon_N", &["Girder"], false),
    ("tendon_mm2", &["Girder"], false),
    ("names_like_grades", &["concrete: \"C30/37\""], false),
];

#[test]
#[ignore = "with_data: reads INTRADOS_DATA/hostile"]
fn matter_and_numbers_mean_what_they_say_with_data() {
    for (name, words, is_doubtful) in MATTER {
        let import = Import::public(name);
        import.says(name, words);
        assert_eq!(is_doubted(&import), is_doubtful, "{name}: {}", import.report["notes"]);
    }
    let marks = Import::public("names_like_grades");
    assert_eq!(marks.number("concrete_assumed"), 11);
    for steel in ["girder_S355J2", "mat_wood_C24", "mat_wood_C30"] {
        assert_eq!(Import::public(steel).number("reinforcement_assumed"), 0, "{steel}");
    }
}

#[test]
#[ignore = "with_data: reads INTRADOS_DATA/hostile"]
fn tendons_are_stressed_as_they_say_with_data() {
    // Force over area by hand.
    for (name, stress) in
        [("tendon_1500kN", 1500e3 / 1800.0), ("tendon_N", 1300.0), ("tendon_mm2", 1300.0)]
    {
        let import = Import::public(name);
        let lines = import.scene.structure.assemblies.iter().flat_map(|a| &a.steel);
        let stresses: Vec<f32> =
            lines.filter_map(|l| Some(l.prestress.as_ref()?.stress_mpa)).collect();
        assert_eq!(stresses.len(), 1, "{name}");
        assert!((f64::from(stresses[0]) / stress - 1.0).abs() < 1e-3, "{name}: {stresses:?}");
    }
}

#[test]
#[ignore = "with_data: reads INTRADOS_DATA/hostile"]
fn bars_and_links_are_counted_with_data() {
    let bar = |d: f64, length: f64| (Part::Bar, d, length);
    let link = |d: f64, length: f64| (Part::Stirrup, d, length);
    let straight = bar(20.0, 3.9);
    // File, steel in members, steel in none, a word of its notes.
    let table: [(&str, Vec<(Part, f64, f64)>, u64, &str); 11] = [
        ("bars_2x3", vec![straight; 2], 0, ""),
        ("bars_mm", vec![straight; 4], 0, ""),
        // 0.75 in; No. 6.
        ("bars_foot", vec![bar(19.1, 3.9); 4], 0, ""),
        ("bars_mapped_set", vec![straight; 4], 0, ""),
        // As IfcOpenShell maps them: by the origin of the map and then by its target.
        ("bars_mapped_mirrored", vec![], 2, "lie in no member"),
        ("bars_mirrored_identity", vec![straight, bar(10.0, 1.95)], 0, "what is drawn is taken"),
        ("bars_nominal_differs", vec![straight; 4], 0, "its area confirms"),
        ("bars_nominal_mm_in_m", vec![straight; 4], 0, ""),
        ("bars_trimmed", vec![bar(20.0, 1.95)], 0, "StartParam and EndParam"),
        ("stirrups", vec![link(8.0, 1.38), link(8.0, 1.28), straight, straight], 0, ""),
        (
            "stirrups_2x3_hooks",
            vec![link(8.0, 1.44), link(8.0, 1.44), link(8.0, 1.44), straight, straight],
            0,
            "",
        ),
    ];
    for (name, mut expected, loose, word) in table {
        let import = Import::public(name);
        let count = import.number("steel_lines");
        assert_eq!(count, expected.len() as u64, "{name}: {}", import.notes);
        // Where the file has none, those that are assumed are drawn.
        let mut found = if count == 0 { vec![] } else { import.steel() };
        let order = |line: &(Part, f64, f64)| (1e3 * line.1 + line.2 * 100.0).round() as i64;
        found.sort_by_key(order);
        expected.sort_by_key(order);
        for (own, hand) in found.iter().zip(&expected) {
            assert_eq!((own.0, own.1), (hand.0, hand.1), "{name}: {found:?}");
            assert!((own.2 - hand.2).abs() < 0.02, "{name}: {found:?}");
        }
        assert_eq!(import.number("loose_steel"), loose, "{name}");
        assert!(import.notes.contains(word), "{name}: {}", import.notes);
        assert_eq!(is_doubted(&import), !word.is_empty(), "{name}: {}", import.notes);
    }
}

/// A column of .4 × .4 × 4 m in mm, with more lines after it: `#33` is the column, `#9` its project,
/// `#50` and further are free.
fn column(more: &str) -> String {
    format!(
        "ISO-10303-21;\nHEADER;\nFILE_DESCRIPTION((''),'2;1');\nFILE_NAME('','',(''),(''),'','','');\nFILE_SCHEMA(('IFC4'));\nENDSEC;\nDATA;\n\
#1=IFCSIUNIT(*,.LENGTHUNIT.,.MILLI.,.METRE.);\n#2=IFCUNITASSIGNMENT((#1));\n\
#3=IFCCARTESIANPOINT((0.,0.,0.));\n#4=IFCAXIS2PLACEMENT3D(#3,$,$);\n\
#5=IFCGEOMETRICREPRESENTATIONCONTEXT($,'Model',3,1.E-05,#4,$);\n\
#9=IFCPROJECT('2tZqmvkcn0LxdhICWnGSaj',$,'P',$,$,$,$,(#5),#2);\n\
#20=IFCCARTESIANPOINT((0.,0.));\n#21=IFCAXIS2PLACEMENT2D(#20,$);\n\
#22=IFCRECTANGLEPROFILEDEF(.AREA.,$,#21,400.,400.);\n#23=IFCDIRECTION((0.,0.,1.));\n\
#24=IFCEXTRUDEDAREASOLID(#22,#4,#23,4000.);\n\
#25=IFCSHAPEREPRESENTATION(#5,'Body','SweptSolid',(#24));\n\
#26=IFCPRODUCTDEFINITIONSHAPE($,$,(#25));\n#27=IFCLOCALPLACEMENT($,#4);\n\
#33=IFCCOLUMN('1JyAjyys5CR9DFg3ucbzCJ',$,'Col 1',$,$,#27,#26,$,$);\n{more}ENDSEC;\nEND-ISO-10303-21;\n"
    )
}

fn of_material(name: &str) -> String {
    column(&format!(
        "#50=IFCMATERIAL('{name}',$,$);\n#51=IFCRELASSOCIATESMATERIAL('3VXNCsitnAX8OWtmb9QzHN',$,$,$,(#33),#50);\n"
    ))
}

fn with_property(property: &str) -> String {
    column(&format!(
        "{property}\n#53=IFCPROPERTYSET('0YX3CenGr7Ywdw25D265M9',$,'Pset_Own',$,(#52));\n\
#54=IFCRELDEFINESBYPROPERTIES('2vM3sZrFPA9Qjuubmn75P0',$,$,$,(#33),#53);\n"
    ))
}

/// Relatives of the files above, as text; they need IfcOpenShell, as the data do.
#[test]
#[ignore = "with_data: reads IFC by IfcOpenShell"]
fn relatives_of_ours_with_data() {
    let materials: [(&str, &[&str], u64); 12] = [
        ("St37-2", &["strength_mpa: 235"], 0),
        ("Q345B", &["strength_mpa: 345"], 0),
        ("GL24h", &["strength_mpa: 24", "modulus_gpa: 11.5"], 0),
        ("Drywall, metal stud", &["gypsum board"], 0),
        ("Crystal", &["glass"], 0),
        ("PVC", &["plastic"], 0),
        ("XK-12", &["\"taken_for\":\"unknown\"", "is none that is known"], 0),
        ("Concrete, 3,000 psi", &["fck_mpa: 20.68"], 1),
        ("Rck 37", &["concrete: \"C30/37\"", "on cubes"], 1),
        ("HA-30/B/20/IIa", &["concrete: \"C30/37\""], 1),
        ("Stahlbeton B45", &["concrete: \"C35/45\"", "DIN 1045"], 1),
        ("<Unnamed>", &["concrete: \"C30/37\"", "no material"], 1),
    ];
    for (name, words, reinforced) in materials {
        let import = Import::written(&of_material(name));
        import.says(name, words);
        assert_eq!(import.number("reinforcement_assumed"), reinforced, "{name}");
    }
    let inch = "#50=IFCSIUNIT(*,.LENGTHUNIT.,.CENTI.,.METRE.);\n#51=IFCMEASUREWITHUNIT(IFCLENGTHMEASURE(2.54),#50);\n#49=IFCDIMENSIONALEXPONENTS(1,0,0,0,0,0,0);\n#48=IFCCONVERSIONBASEDUNIT(#49,.LENGTHUNIT.,'INCH',#51);\n";
    let properties = [
        (
            format!("{inch}#52=IFCPROPERTYSINGLEVALUE('ConcreteCover',$,IFCPOSITIVELENGTHMEASURE(2.),#48);"),
            vec!["cover_mm: 50.8,"],
        ),
        (
            "#52=IFCPROPERTYSINGLEVALUE('ConcreteCover',$,IFCLABEL('4,5 cm'),$);".into(),
            vec!["cover_mm: 45,"],
        ),
        (
            "#52=IFCPROPERTYSINGLEVALUE('ConcreteCover',$,IFCPOSITIVELENGTHMEASURE(900.),$);".into(),
            vec!["cover_mm: 40,", "ConcreteCover says 900"],
        ),
        (
            "#52=IFCPROPERTYSINGLEVALUE('Compressive strength test age days',$,IFCREAL(28.),$);".into(),
            vec!["concrete: \"C30/37\"", "assumed: [Concrete,"],
        ),
        (
            "#50=IFCSIUNIT(*,.PRESSUREUNIT.,.MEGA.,.PASCAL.);\n#52=IFCPROPERTYSINGLEVALUE('CharacteristicCubeStrength',$,IFCPRESSUREMEASURE(50.),#50);".into(),
            vec!["concrete: \"C40/50\""],
        ),
    ];
    for (property, words) in properties {
        Import::written(&with_property(&property)).says(&property, &words);
    }
    // A library beside the project, in metres; another project; before it and after it in the file.
    for context in [
        "IFCPROJECTLIBRARY('0ZW6nt6ufFHOouqrbNhjCP',$,'L',$,$,$,$,$,#51)",
        "IFCPROJECT('0ZW6nt6ufFHOouqrbNhjCP',$,'Q',$,$,$,$,$,#51)",
    ] {
        for number in [7, 52] {
            let more = format!(
                "#50=IFCSIUNIT(*,.LENGTHUNIT.,$,.METRE.);\n#51=IFCUNITASSIGNMENT((#50));\n#{number}={context};\n"
            );
            Import::written(&column(&more)).says(context, &["4.00 m, 0.40 by 0.40 m"]);
        }
    }
    no_members();
    layers_and_sizes();
}

/// A slab with asphalt on it is a slab of concrete; numbers that are in another unit than the file
/// says are doubted.
fn layers_and_sizes() {
    let layers = "#50=IFCMATERIAL('Asphalt',$,$);\n#51=IFCMATERIAL('Concrete C35/45',$,$);\n#52=IFCMATERIALLAYER(#50,120.,$,$,$,$,$);\n#53=IFCMATERIALLAYER(#51,250.,$,$,$,$,$);\n#54=IFCMATERIALLAYERSET((#52,#53),$,$);\n#55=IFCRELASSOCIATESMATERIAL('3VXNCsitnAX8OWtmb9QzHN',$,$,$,(#33),#54);\n";
    let slab = Import::written(&column(layers).replace("IFCCOLUMN(", "IFCSLAB("));
    slab.says("asphalt on a slab", &["concrete: \"C35/45\""]);
    assert_eq!(slab.report["members"]["slab"], 1, "{}", slab.report);
    let in_metres = column("").replace("400.,400.", "0.4,0.4").replace(",4000.)", ",4.)");
    Import::written(&in_metres).says("metres called mm", &["are its numbers in another?"]);
}

/// An IFC file is told what IFC needs.
fn no_members() {
    let text = column("").replace("IFCCOLUMN(", "IFCFURNITURE(");
    let import = Import::written(&text);
    import.says("no members", &["no structural members", "IfcColumn"]);
    assert!(!import.notes.contains("COL_"), "{}", import.notes);
}
