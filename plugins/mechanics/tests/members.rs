//! Bundled members, looked into.
use intrados_mechanics::{analysis::{analyze, Observer}, member::{Meshing, prepare}, model::*};
use intrados_scene::Scene;
use intrados_stage::Job;

struct Look;
impl Observer for Look {
    fn see(&mut self, s: &Structure, h: &History, step: &Step, points: &[[Point; 8]]) -> Result<(), Failure> {
        let mut worst = (0.0, 0, 0);
        for (i, w) in h.steel.iter().enumerate() { for (k, p) in w.iter().enumerate() { if p.stress.abs() > worst.0 { worst = (p.stress.abs(), i, k); } } }
        let st = &s.model.steel[worst.1];
        let p = &st.pieces[worst.2];
        let crack = points.iter().enumerate().map(|(e, p)| (p.iter().map(|p| p.crack).fold(0.0, f64::max), e)).fold((0.0, 0), |m: (f64, usize), x| if x.0 > m.0 { x } else { m });
        println!("day {:.2} it {} lin {} res {:.1e} bar {} {:.0} MPa at {:.2?} stress {:.0} crack {:.3} mm at {:.2?}", step.time / 86400.0, step.iterations, step.linear, step.residual, st.name, worst.0 / 1e6, p.ends[0].to_array(), h.steel[worst.1][worst.2].stress/1e6, crack.0*1e3, s.model.mesh.centre(crack.1 as u32).to_array());
        Ok(())
    }
}

#[test]
#[ignore = "a look"]
fn look() {
    let name = std::env::var("SCENE").unwrap();
    let id = std::env::var("MEMBER").unwrap();
    let job = Job::default();
    let scene = Scene::load_bundled(&name, &job).unwrap();
    let member = scene.file.members.iter().find(|m| m.id == id).unwrap();
    let element = std::env::var("ELEMENT").ok().map(|e| e.parse().unwrap());
    let prepared = prepare(&scene, member, Meshing { element }).unwrap();
    let (outcome, _) = analyze(&prepared, Settings { tolerance: 1e-3, loose: 10.0, ..Settings::default() }, &job, &mut Look).unwrap();
    println!("{:#?}", outcome.members[0]);
    println!("{}", outcome.complaint);
}
