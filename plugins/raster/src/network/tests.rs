use intrados_stage::{Job, random::Key};
use rayon::prelude::*;

use super::*;

fn drawn(planes: usize, width: usize, height: usize, key: Key) -> Planes {
    let mut drawn = Planes::new(planes, width, height);
    for (plane, y) in (0..planes).flat_map(|p| (0..height).map(move |y| (p, y))) {
        for (x, v) in drawn.row_mut(plane, y).iter_mut().enumerate() {
            *v = key.unit(((plane * height + y) * width + x) as u32) - 0.3;
        }
    }
    drawn
}

/// Half the square of what is given less what is wanted, and its gradient.
fn squares(out: &Planes, wanted: &Planes) -> (f32, Planes) {
    let mut gradient = Planes::new(out.planes(), out.width(), out.height());
    let mut loss = 0.0_f64;
    for (plane, y) in (0..out.planes()).flat_map(|p| (0..out.height()).map(move |y| (p, y))) {
        let rows = out.row(plane, y).iter().zip(wanted.row(plane, y));
        for (g, (o, w)) in gradient.row_mut(plane, y).iter_mut().zip(rows) {
            *g = (o - w) / 100.0;
            loss += f64::from(0.5 * (o - w) * (o - w) / 100.0);
        }
    }
    (loss as f32, gradient)
}

/// The gradient of a loss against central differences, for weights of every layer of networks of
/// two to four levels. Rectifiers and maxima have corners, which a small step rarely crosses.
#[test]
fn gradient_equals_differences() {
    for levels in [vec![4, 8], vec![4, 8, 8], vec![4, 8, 12, 16]] {
        let shape = Shape { inputs: 3, levels, outputs: 8 };
        let seen = drawn(3, 24, 16, Key::new(5, 0));
        let wanted = drawn(8, 24, 16, Key::new(6, 0));
        let mut network = Unet::untrained(shape.clone(), 3);
        let loss = |network: &Unet| network.gradient(seen.clone(), |out| squares(out, &wanted));
        let (_, learnt) = loss(&network);
        for layer in 0..network.layers.len() {
            for range in network.places(layer) {
                let at = range.max_by(|&a, &b| learnt[a].abs().total_cmp(&learnt[b].abs()));
                let at = at.unwrap();
                let (old, step) = (network.weights[at], 2e-4);
                let sides = [old + step, old - step].map(|v| {
                    network.weights[at] = v;
                    loss(&network).0
                });
                network.weights[at] = old;
                let difference = (sides[0] - sides[1]) / (2.0 * step);
                assert!(
                    (difference - learnt[at]).abs() < 0.05 * learnt[at].abs() + 5e-4,
                    "{shape:?}, layer {layer}: {difference} and {}",
                    learnt[at]
                );
            }
        }
    }
}

fn trained(threads: usize) -> (Vec<f32>, Unet) {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
    pool.install(|| {
        let shape = Shape { inputs: 2, levels: vec![4, 8], outputs: 4 };
        let mut network = Unet::untrained(shape, 1);
        let mut optimiser = Optimiser::new(network.weights().len());
        let schedule = Schedule { rate: 3e-3, steps: 80 };
        let lesson = |i: u64| drawn(2, 16, 16, Key::new(i % 3, 1));
        let losses = (0..80).map(|step| {
            let learn = |i: u64| {
                let wanted = drawn(4, 16, 16, Key::new(i % 3, 2));
                network.gradient(lesson(i), |out| squares(out, &wanted))
            };
            let learnt: Vec<_> = (0..6_u64).into_par_iter().map(learn).collect();
            let (loss, gradient) = mean(&learnt);
            optimiser.step(network.weights_mut(), &gradient, schedule.at(step), 1e-4);
            loss
        });
        (losses.collect(), network)
    })
}

#[test]
fn training_repeats_to_the_bit_on_any_number_of_threads_and_learns() {
    let ((losses, one), (again, three)) = (trained(1), trained(3));
    assert_eq!(losses, again);
    assert_eq!(one, three);
    assert!(losses[79] < 0.75 * losses[0], "{} {}", losses[0], losses[79]);
}

#[test]
fn weights_are_read_as_they_were_written_and_nothing_else_is() {
    let shape = Shape { inputs: 5, levels: vec![8, 12], outputs: 4 };
    let network = Unet::untrained(shape.clone(), 9);
    let bytes = network.to_bytes();
    assert_eq!(bytes.len(), 4 * shape.count());
    assert_eq!(Unet::from_bytes(shape.clone(), &bytes), Some(network));
    assert_eq!(Unet::from_bytes(shape.clone(), &bytes[4..]), None);
    let mut broken = bytes;
    broken[..4].copy_from_slice(&f32::NAN.to_le_bytes());
    assert_eq!(Unet::from_bytes(shape, &broken), None);
}

/// Looking gives what training saw, whatever memory was used before.
#[test]
fn looking_and_learning_see_the_same() {
    let network = Unet::untrained(Shape { inputs: 2, levels: vec![4, 8, 8], outputs: 4 }, 2);
    let seen = drawn(2, 32, 24, Key::new(1, 1));
    let mut spare = Spare::default();
    let first = network.look(seen.clone(), &mut spare, &Job::default()).unwrap();
    let second = network.look(seen.clone(), &mut spare, &Job::default()).unwrap();
    assert_eq!(first, second);
    network.gradient(seen, |out| {
        assert_eq!(*out, first);
        (0.0, out.clone())
    });
}

/// The gradient through standardised weights, of weights, biases and gains of all layers.
#[test]
fn standardised_gradient_equals_differences() {
    let shape = Shape { inputs: 3, levels: vec![4, 8], outputs: 4 };
    let seen = drawn(3, 24, 16, Key::new(5, 0));
    let wanted = drawn(4, 24, 16, Key::new(6, 0));
    let mut trained = Standardised::new(shape, 3);
    let loss = |trained: &Standardised| {
        trained.network().gradient(seen.clone(), |out| squares(out, &wanted))
    };
    let learnt = trained.gradient(&loss(&trained).1);
    assert_eq!(learnt.len(), trained.parameters().len());
    let count = trained.parameters().len();
    for part in 0..16 {
        let range = part * count / 16..(part + 1) * count / 16;
        let at = range.max_by(|&a, &b| learnt[a].abs().total_cmp(&learnt[b].abs())).unwrap();
        let (old, step) = (trained.parameters()[at], 3e-4);
        let sides = [old + step, old - step].map(|v| {
            trained.parameters_mut()[at] = v;
            loss(&trained).0
        });
        trained.parameters_mut()[at] = old;
        let difference = (sides[0] - sides[1]) / (2.0 * step);
        assert!(
            (difference - learnt[at]).abs() < 0.05 * learnt[at].abs() + 1e-3,
            "parameter {at}: {difference} and {}",
            learnt[at]
        );
    }
}
