//! Results as property sets of the model that a scene was imported from.

#![allow(clippy::unwrap_used, reason = "a test may panic")]

mod common;

use std::{fs, path::Path};

use common::{run, text};

/// Of the beam in `reinforcing-assembly.ifc`, which is imported, predicted and written back: once
/// more into what was written, the set is there once.
#[test]
#[ignore = "with_data: reads INTRADOS_DATA/ifc by IfcOpenShell"]
fn results_go_into_a_copy_of_the_model_with_data() {
    let data = std::env::var("INTRADOS_DATA").unwrap();
    let model = Path::new(&data).join("ifc/reinforcing-assembly.ifc");
    let place = tempfile::tempdir().unwrap();
    let at = |name: &str| place.path().join(name);
    let (project, out) = (at("beam"), at("out"));
    assert!(run(&["import", text(&model), "--out", text(&project)]).status.success());
    let predict = |model: &Path| {
        let quick = ["--no-forecast", "--spp", "0", "--out", text(&out), "--ifc", text(model)];
        let output = run(&[&["predict", text(&project)], &quick[..]].concat());
        (output.status.code(), String::from_utf8_lossy(&output.stderr).into_owned())
    };
    assert_eq!(predict(&model).0, Some(0));
    let written = out.join("reinforcing-assembly_damage.ifc");
    let sets = |file: &Path| {
        let text = fs::read_to_string(file).unwrap();
        let of = |word: &str| text.matches(word).count();
        [of("IFCPROPERTYSET("), of("'Intrados_Damage'"), of("IFCREINFORCINGBAR(")]
    };
    let ([before, _, bars], [after, ours, kept]) = (sets(&model), sets(&written));
    assert_eq!([after, ours, kept], [before + 1, 1, bars]);
    // A label has at most 255 characters.
    let text_of = fs::read_to_string(&written).unwrap();
    assert!(text_of.contains("'Advice',$,IFCTEXT(") && !text_of.contains("'Advice',$,IFCLABEL("));
    let again = at("again.ifc");
    fs::copy(&written, &again).unwrap();
    assert_eq!(predict(&again).0, Some(0));
    assert_eq!(sets(&out.join("again_damage.ifc")), [after, 1, bars]);
    // Another structure's model is refused before anything is computed.
    let other = Path::new(&data).join("ifc/infra-bridge.ifc");
    let (code, said) = predict(&other);
    assert!(code == Some(65) && said.contains("none of the 1 members"), "{said}");
}
