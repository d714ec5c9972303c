//! What changes the weights: AdamW (Loshchilov and Hutter 2019) with clipped gradients, a rate that
//! warms up and cools down.

/// AdamW with clipped gradients.
#[derive(Debug, Clone)]
pub struct Optimiser {
    means: Vec<f32>,
    squares: Vec<f32>,
    steps: i32,
}

impl Optimiser {
    /// One of so many weights that has not seen a gradient yet.
    #[must_use]
    pub fn new(count: usize) -> Self {
        let none = vec![0.0; count];
        Self { means: none.clone(), squares: none, steps: 0 }
    }

    /// One step down the gradient.
    pub fn step(&mut self, weights: &mut [f32], gradient: &[f32], rate: f32, decay: f32) {
        const BETA: [f32; 2] = [0.9, 0.999];
        self.steps += 1;
        let length = gradient.iter().map(|g| f64::from(*g).powi(2)).sum::<f64>().sqrt() as f32;
        let clip = 1.0 / length.max(1.0);
        let [a, b] = BETA.map(|b| 1.0 - b.powi(self.steps));
        for (((w, g), m), s) in
            weights.iter_mut().zip(gradient).zip(&mut self.means).zip(&mut self.squares)
        {
            let g = g * clip;
            *m = BETA[0] * *m + (1.0 - BETA[0]) * g;
            *s = BETA[1] * *s + (1.0 - BETA[1]) * g * g;
            *w -= rate * (*m / a / ((*s / b).sqrt() + 1e-8) + decay * *w);
        }
    }
}

/// How the rate changes from step to step.
#[derive(Debug, Clone, Copy)]
pub struct Schedule {
    /// Highest rate.
    pub rate: f32,
    /// Steps altogether.
    pub steps: usize,
}

/// Steps until the rate is at its highest.
const WARM: f32 = 60.0;

impl Schedule {
    /// The rate of a step: it rises evenly and falls to 0 by half a cosine.
    #[must_use]
    pub fn at(&self, step: usize) -> f32 {
        let warm = ((step + 1) as f32 / WARM).min(1.0);
        let cool = 0.5 * (1.0 + (std::f32::consts::PI * step as f32 / self.steps as f32).cos());
        self.rate * warm * cool
    }
}

/// The mean of what several crops gave: loss and gradient, added in their order.
#[must_use]
pub fn mean(learnt: &[(f32, Vec<f32>)]) -> (f32, Vec<f32>) {
    let share = 1.0 / learnt.len().max(1) as f32;
    let (mut loss, mut gradient) = (0.0, vec![0.0; learnt.first().map_or(0, |(_, g)| g.len())]);
    for (l, g) in learnt {
        loss += share * l;
        gradient.iter_mut().zip(g).for_each(|(sum, g)| *sum += share * g);
    }
    (loss, gradient)
}
