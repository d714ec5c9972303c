//! Real models from the data folder (`INTRADOS_DATA`).

use std::{collections::BTreeMap, path::PathBuf};

use intrados_scene::{MemberKind, Part, Surface, gltf};
use intrados_stage::Job;

fn model(name: &str) -> gltf::Model {
    let data =
        std::env::var_os("INTRADOS_DATA").expect("INTRADOS_DATA must name the folder of test data");
    let path = PathBuf::from(data).join("models").join(name);
    gltf::import(&path, &Job::default()).expect("a legal model")
}

fn kinds(model: &gltf::Model) -> BTreeMap<MemberKind, usize> {
    let mut kinds = BTreeMap::new();
    for member in &model.members {
        *kinds.entry(member.kind).or_default() += 1;
    }
    kinds
}

/// Ignored, since nothing can be said without them:
/// `INTRADOS_DATA=… cargo test --release --workspace -- --ignored with_data`.
mod with_data {
    use super::*;

    #[test]
    #[ignore = "needs INTRADOS_DATA"]
    fn the_bridge_has_its_members() {
        let model = model("infra_bridge.glb");
        let kinds = kinds(&model);
        let expected = [
            (MemberKind::Column, 7),
            (MemberKind::Beam, 8),
            (MemberKind::Footing, 7),
            (MemberKind::Slab, 3),
            (MemberKind::Wall, 4),
        ];
        for (kind, count) in expected {
            assert_eq!(kinds.get(&kind), Some(&count), "{kind:?}");
        }
        let beam = model
            .members
            .iter()
            .find(|m| m.id == "322tROdCvE68UcU2Qe02GA")
            .expect("the first beam");
        // The IFC file's own quantity, Qto_BeamBaseQuantities.NetVolume.
        assert!((beam.volume - 0.346_112_8).abs() < 1e-4 * 0.346, "{}", beam.volume);
        assert!(beam.concrete_assumed);
        assert!(
            model
                .members
                .iter()
                .all(|m| m.bounds[0].cmple(m.bounds[1]).all() && m.bounds[1].is_finite())
        );
        assert!(!model.warnings.iter().any(|w| w.contains("mm or m")), "{:?}", model.warnings);
    }

    #[test]
    #[ignore = "needs INTRADOS_DATA"]
    fn the_reinforced_beam_has_34_bars() {
        let model = model("reinf_assembly.glb");
        assert_eq!(kinds(&model), BTreeMap::from([(MemberKind::Beam, 1), (MemberKind::Bar, 34)]));
        assert_eq!(model.objects.iter().filter(|o| o.part == Part::Bar).count(), 34);
        assert_eq!(model.objects.iter().filter(|o| o.part == Part::Concrete).count(), 1);
        let beam = model.members.iter().find(|m| m.kind == MemberKind::Beam).expect("the beam");
        let size = beam.bounds[1] - beam.bounds[0];
        // A box: 0.2 m x 0.4 m x 5 m.
        assert!(
            (beam.volume - 0.4).abs() < 1e-6
                && (f64::from(size.element_product()) - beam.volume).abs() < 1e-6,
            "{} {size}",
            beam.volume
        );
    }

    #[test]
    #[ignore = "needs INTRADOS_DATA"]
    fn the_cornell_box_has_its_lamp_and_colours() {
        let model = model("CornellBox.glb");
        let lamp = model.materials.iter().find(|m| m.emission.x > 0.0).expect("an emitter");
        // 100 nits.
        assert!((lamp.emission.x - 100.0 / 683.0).abs() < 1e-6, "{}", lamp.emission);
        assert!(
            model
                .meshes
                .iter()
                .any(|m| !m.colours.is_empty() && m.colours.iter().all(|c| c.max_element() <= 1.0))
        );
        assert!(model.warnings.iter().any(|w| w.contains("COL_")), "{:?}", model.warnings);
    }

    #[test]
    #[ignore = "needs INTRADOS_DATA"]
    fn a_negative_scale_mirrors() {
        let model = model("IrradianceVolumeExample.glb");
        assert!(!model.objects.is_empty());
        assert!(model.objects.iter().all(|o| o.transform.determinant() < 0.0));
        assert!(model.materials.iter().any(|m| matches!(m.surface, Surface::Metallic { .. })));
    }
}
