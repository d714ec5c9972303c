//! OBJ files: what each file of the folder becomes, and relatives of our own making.

use std::{fmt::Write, fs, path::Path};

use serde_json::Value;

use crate::{hostile, run, said};

/// What an import made of a file.
pub(crate) struct Imported {
    /// Its exit code, and what it said.
    pub(crate) code: i32,
    pub(crate) said: String,
    /// Name of a member, and its length, measures across (m) and volume (m³).
    pub(crate) members: Vec<(String, [f64; 4])>,
    /// What was taken off all coordinates, m.
    pub(crate) offset: [f64; 3],
    /// Extent of the scene, m.
    pub(crate) extent: [f64; 3],
}

/// Imports a file with these options into a folder of its own.
pub(crate) fn import(path: &Path, options: &[&str]) -> Imported {
    let place = tempfile::tempdir().unwrap();
    let out = place.path().join("out");
    let own = ["import", path.to_str().unwrap(), "--out", out.to_str().unwrap()];
    let output = run(&[&own[..], &["--format", "json"], options].concat());
    let code = output.status.code().unwrap_or(-1);
    let failed = Imported {
        code,
        said: said(&output),
        members: Vec::new(),
        offset: [0.0; 3],
        extent: [0.0; 3],
    };
    if code != 0 {
        return failed;
    }
    let answer: Value = serde_json::from_slice(&output.stdout).unwrap();
    let numbers = |value: &Value| [0, 1, 2].map(|i| value[i].as_f64().unwrap());
    let scene = out.join("scene.ron");
    let info = run(&["info", scene.to_str().unwrap(), "--format", "json", "--quiet"]);
    let info: Value = serde_json::from_slice(&info.stdout).unwrap();
    Imported {
        members: members(&fs::read_to_string(scene).unwrap()),
        offset: numbers(&answer["offset_m"]),
        extent: numbers(&info["scenes"][0]["size"]),
        ..failed
    }
}

/// Members as comments of a written scene list them.
fn members(scene: &str) -> Vec<(String, [f64; 4])> {
    let one = |line: &str| {
        let (head, tail) = line.trim().strip_prefix("// ")?.split_once("\": ")?;
        let name = head.split_once('"')?.1.to_owned();
        let numbers: Vec<f64> =
            tail.split([' ', ',']).filter_map(|word| word.parse().ok()).take(4).collect();
        Some((name, numbers.try_into().ok()?))
    };
    scene.lines().filter(|line| line.contains("m across")).filter_map(one).collect()
}

/// A case of a table: the file, options, members with length, width, depth and volume, words that
/// are said; a first word with `!` in front must not be.
pub(crate) type Case<'a> = (&'a str, &'a [&'a str], &'a [(&'a str, [f64; 4])], &'a [&'a str]);

/// Fails where a file became anything else.
pub(crate) fn check(path: &Path, (name, options, expected, words): &Case) {
    let found = import(path, options);
    let at = format!("{name} {options:?}: {} {:?}", found.said, found.members);
    assert_eq!(found.code == 0, !expected.is_empty() || words.first() == Some(&"scenery"), "{at}");
    assert_eq!(found.members.len(), expected.len(), "{at}");
    for (id, measures) in *expected {
        let member = found.members.iter().find(|(own, _)| own == id);
        let (_, own) = member.unwrap_or_else(|| panic!("{id} is missing: {at}"));
        for (a, b) in own.iter().zip(measures) {
            // Printed to centimetres and litres.
            assert!((a - b).abs() <= 0.0051 + 1e-3 * b, "{id}: {own:?} for {measures:?}; {at}");
        }
    }
    for word in words.iter().filter(|w| **w != "scenery") {
        match word.strip_prefix('!') {
            Some(word) => assert!(!found.said.contains(word), "{word}: {at}"),
            None => assert!(found.said.contains(word), "{word}: {at}"),
        }
    }
}

/// A refusal: one line, the code of bad input.
fn refused(path: &Path, words: &[&str]) {
    let found = import(path, &[]);
    assert_eq!(found.code, 65, "{}", found.said);
    assert_eq!(found.said.trim().lines().count(), 1, "{}", found.said);
    words.iter().for_each(|word| assert!(found.said.contains(word), "{word}: {}", found.said));
}

const COLUMN: [f64; 4] = [4.0, 0.4, 0.4, 0.64];
const BEAM: [f64; 4] = [8.0, 0.6, 0.4, 1.92];
const QUIET: &[&str] = &["!is z up", "!--unit", "!apart", "!comma"];

#[test]
#[ignore = "with_data: reads INTRADOS_DATA/hostile"]
fn every_file_of_the_folder_with_data() {
    let column: &[(&str, [f64; 4])] = &[("Column_1", COLUMN)];
    let frame: &[(&str, [f64; 4])] = &[("Column_1", COLUMN), ("Beam_1", BEAM)];
    let two: &[(&str, [f64; 4])] = &[("Column_1", COLUMN), ("Column_2", COLUMN)];
    let three: &[(&str, [f64; 4])] =
        &[("Column_1", COLUMN), ("Column_2", COLUMN), ("Column_3", COLUMN)];
    let portal: &[(&str, [f64; 4])] = &[("Wall_1", [3.0, 0.3, 4.0, 2.4])];
    let cases: &[Case] = &[
        ("plain.obj", &[], frame, QUIET),
        ("bom.obj", &[], column, QUIET),
        ("colours.obj", &[], column, QUIET),
        ("comma.obj", &[], column, &["8 numbers have a comma"]),
        ("concave_L.obj", &[], &[("Beam_L", [6.0, 0.8, 0.6, 1.44])], QUIET),
        ("concave_portal.obj", &[], portal, QUIET),
        ("concave_portal_triangles.obj", &[], portal, QUIET),
        ("continuation.obj", &[], column, QUIET),
        ("continuation_face.obj", &[], column, QUIET),
        (
            "groups.obj",
            &[],
            &[("Column_1 concrete layer5", COLUMN), ("Column_2 concrete layer5", COLUMN)],
            QUIET,
        ),
        ("late_vertices.obj", &[], column, QUIET),
        ("latin1.obj", &[], &[("Stütze_1", COLUMN)], &["Latin-1"]),
        ("mm.obj", &["--unit", "mm"], column, QUIET),
        ("neg_crlf.obj", &[], two, QUIET),
        ("open_top.obj", &[], column, QUIET),
        ("rd_coordinates.obj", &[], three, &["!--unit", "!is z up"]),
        ("utm_coordinates.obj", &[], column, &["!--unit", "!is z up"]),
        (
            "same_name.obj",
            &[],
            &[("Column", COLUMN), ("Column #2", COLUMN)],
            &["\"Column\" (2 times)"],
        ),
        ("unit_cm.obj", &["--unit", "cm"], frame, QUIET),
        ("unit_foot.obj", &["--unit", "ft"], frame, QUIET),
        (
            "unit_foot.obj",
            &[],
            &[("Column_1", [13.12, 1.31, 1.31, 22.6]), ("Beam_1", [26.25, 1.97, 1.31, 67.8])],
            &["--unit ft", "8.0"],
        ),
        ("z_up.obj", &["--up", "z"], frame, QUIET),
        (
            "z_up_unnamed.obj",
            &[],
            &[],
            &["scenery", "is z up", "name its objects or groups", "Mesh_1"],
        ),
    ];
    for case in cases {
        check(&hostile("public/obj").join(case.0), case);
    }
    refused(&hostile("public/obj/mm.obj"), &["Column_1", "4.0 km", "--unit mm"]);
    // Read as they stand, they are doubted before any number counts.
    for (file, words) in [
        ("unit_cm.obj", ["\"Beam_1\" is 800.00 m long", "cm (8.00 m)", "--unit m"]),
        ("z_up.obj", ["\"Column_1\" lies along z", "is z up", "--up z"]),
    ] {
        let found = import(&hostile("public/obj").join(file), &[]);
        words.iter().for_each(|word| assert!(found.said.contains(word), "{word}: {}", found.said));
    }
    // Nothing is lost of a national grid, and where it lay is said.
    let found = import(&hostile("public/obj/rd_coordinates.obj"), &[]);
    assert_eq!(found.offset[0], 155_003.0, "{:?}", found.offset);
    assert!((found.extent[0] - 5.14).abs() < 1e-4, "{:?}", found.extent);
    let known = fs::read_dir(hostile("public/obj")).unwrap().count();
    let seen: std::collections::BTreeSet<&str> = cases.iter().map(|c| c.0).collect();
    assert_eq!(seen.len(), known, "a file of the folder is in no case");
}

/// A box from a corner, with faces that count from `first`.
fn block(name: &str, [x, y, z]: [f64; 3], [a, b, c]: [f64; 3], first: usize) -> String {
    let mut text = format!("{name}\n");
    for k in [[0., 0., 0.], [1., 0., 0.], [1., 1., 0.], [0., 1., 0.]] {
        let _ = writeln!(text, "v {} {} {}", x + a * k[0], y + b * k[1], z);
    }
    for k in [[0., 0.], [1., 0.], [1., 1.], [0., 1.]] {
        let _ = writeln!(text, "v {} {} {}", x + a * k[0], y + b * k[1], z + c);
    }
    for face in [[1, 4, 3, 2], [5, 6, 7, 8], [1, 2, 6, 5], [2, 3, 7, 6], [3, 4, 8, 7], [4, 1, 5, 8]]
    {
        let [p, q, r, s] = face.map(|i| i + first - 1);
        let _ = writeln!(text, "f {p} {q} {r} {s}");
    }
    text
}

/// A prism over a flat outline of z, from z = 0 to a depth.
fn prism(name: &str, outline: &[[f64; 2]], depth: f64) -> String {
    let n = outline.len();
    let mut text = format!("o {name}\n");
    for z in [0.0, depth] {
        for [x, y] in outline {
            let _ = writeln!(text, "v {x} {y} {z}");
        }
    }
    let numbers = |all: &mut dyn Iterator<Item = usize>| {
        all.map(|i| i.to_string()).collect::<Vec<_>>().join(" ")
    };
    let _ = writeln!(text, "f {}", numbers(&mut (1..=n).rev()));
    let _ = writeln!(text, "f {}", numbers(&mut (n + 1..=2 * n)));
    for k in 0..n {
        let m = (k + 1) % n;
        let _ = writeln!(text, "f {} {} {} {}", k + 1, m + 1, m + 1 + n, k + 1 + n);
    }
    text
}

/// Relatives: each kind of the folder in other words.
#[test]
fn relatives_of_the_folder() {
    let place = tempfile::tempdir().unwrap();
    let column = |name: &str, x: f64, first| block(name, [x, 0.0, 0.0], [0.4, 4.0, 0.4], first);
    let plain = column("o Column_1", 0.0, 1);
    let one: &[(&str, [f64; 4])] = &[("Column_1", COLUMN)];
    // Its sections are 3, 2 and 1 m high: the middle one is said.
    let stair = [[0., 0.], [3., 0.], [3., 3.], [2., 3.], [2., 2.], [1., 2.], [1., 1.], [0., 1.]];
    // A window whose opening is reached by a bridge edge, and a comb of three teeth.
    let window = [
        [0., 0.],
        [4., 0.],
        [4., 3.],
        [0., 3.],
        [0., 0.],
        [1., 1.],
        [1., 2.],
        [3., 2.],
        [3., 1.],
        [1., 1.],
    ];
    let cases: Vec<(&str, String, Case)> = vec![
        (
            "stair",
            prism("Wall_2", &stair, 0.3),
            ("", &[], &[("Wall_2", [3., 0.3, 2., 1.8])], QUIET),
        ),
        (
            "window",
            prism("Wall_3", &window, 0.3),
            ("", &[], &[("Wall_3", [3., 0.3, 4., 3.0])], QUIET),
        ),
        (
            "lambert",
            plain
                .lines()
                .map(|l| match l.strip_prefix("v ") {
                    Some(v) => {
                        let c: Vec<f64> = v.split(' ').map(|x| x.parse().unwrap()).collect();
                        format!(
                            "v {} {} {}\n",
                            c[0] + 652_469.031,
                            c[1] + 212.5,
                            c[2] - 6_862_035.187
                        )
                    }
                    None => format!("{l}\n"),
                })
                .collect(),
            ("", &[], one, &["!--unit", "!is z up"]),
        ),
        ("cr", plain.replace('\n', "\r"), ("", &[], one, QUIET)),
        (
            "comments",
            format!("# made by hand\n{}", plain.replace(" 0 0\n", " 0 0 # corner\n")),
            ("", &[], one, QUIET),
        ),
        ("broken line", plain.replace("v 0.4 ", "v \\\r\n0.4 \\\n "), ("", &[], one, QUIET)),
        (
            "resumed",
            {
                // One group in two pieces, around another.
                let other = column("g Column_2", 3.0, 9);
                let (front, back) = plain.split_once("f 2 3").unwrap();
                format!("{}{other}g Column_1\nf 2 3{back}", front.replace("o ", "g "))
            },
            ("", &[], &[("Column_1", COLUMN), ("Column_2", COLUMN)], QUIET),
        ),
        (
            "one name, one group",
            format!("{}{}", column("g Columns", 0.0, 1), column("", 5.0, 9)),
            (
                "",
                &[],
                &[("Columns", COLUMN), ("Columns #2", COLUMN)],
                &["lie apart", "\"Columns\" (2 bodies)"],
            ),
        ),
        (
            "materials within one object",
            format!(
                "{}{}",
                plain.replace("f 2 3", "g Column_1_side\nusemtl C40/50\nf 2 3"),
                column("o Column_2", 2.0, 9)
            ),
            ("", &[], &[("Column_1", COLUMN), ("Column_2", COLUMN)], QUIET),
        ),
        (
            "inches",
            block("o Beam_1", [0.0; 3], [315.0, 24.0, 16.0], 1),
            ("", &["--unit", "in"], &[("Beam_1", [8.0, 0.61, 0.41, 1.982])], QUIET),
        ),
        (
            "a slab that stands",
            block("o Slab_1", [0.0; 3], [6.0, 5.0, 0.2], 1),
            ("", &["--up", "z"], &[("Slab_1", [6.0, 0.2, 5.0, 6.0])], QUIET),
        ),
        (
            "a deck is long",
            block("o Deck", [0.0; 3], [140.0, 0.3, 12.0], 1),
            ("", &[], &[("Deck", [140.0, 0.3, 12.0, 504.0])], &["!--unit", "!is z up"]),
        ),
    ];
    for (name, text, case) in cases {
        let path = place.path().join(format!("{name}.obj"));
        fs::write(&path, text).unwrap();
        check(&path, &(name, case.1, case.2, case.3));
    }
    for (name, bytes, words) in [
        ("wide", plain.encode_utf16().flat_map(u16::to_le_bytes).collect(), vec!["is not text"]),
        ("far", plain.replace("f 2 3", "f 2 33").into_bytes(), vec![":13:1", "no vertex 33"]),
        (
            "nan",
            plain.replace("v 0.4 0 0\n", "v nan 0 0\n").into_bytes(),
            vec!["three finite numbers"],
        ),
        ("thousands", plain.replace("v 0.4 0 0\n", "v 1,000.4 0 0\n").into_bytes(), vec![":3:1"]),
    ] {
        let bytes: Vec<u8> = bytes;
        let path = place.path().join(format!("{name}.obj"));
        fs::write(&path, bytes).unwrap();
        refused(&path, &words);
    }
}

/// An outline of 4000 corners, half of them of notches.
#[test]
fn a_face_of_many_corners_is_cut() {
    let place = tempfile::tempdir().unwrap();
    let path = place.path().join("many.obj");
    let n = 1000;
    let teeth = (0..n).flat_map(|k| {
        let x = 40.0 * f64::from(k) / f64::from(n);
        let half = 20.0 / f64::from(n);
        [[x, 10.0], [x, 9.9], [x + half, 9.9], [x + half, 10.0]]
    });
    let outline: Vec<[f64; 2]> =
        teeth.chain([[40.0, 10.0], [40.0, 0.0], [0.0, 0.0]]).collect::<Vec<_>>();
    let outline: Vec<[f64; 2]> = outline.into_iter().rev().collect();
    fs::write(&path, prism("Wall_1", &outline, 0.3)).unwrap();
    check(&path, &("many", &[], &[("Wall_1", [10.0, 0.3, 40.0, 119.4])], QUIET));
}
