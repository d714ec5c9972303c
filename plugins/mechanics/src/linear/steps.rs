//! What has an order: what is in force when a step ends becomes a step of the deck.

mod equation;
mod load;
mod needs;
mod procedure;

use std::collections::BTreeMap;

use glam::DVec3;

use super::{
    model::{Heated, Procedure, Step},
    read::{Reader, plain},
};
use crate::{
    model::interpolate,
    read::{Amplitude, Fault, abaqus::card::Card, quote},
};
use procedure::{begin, procedure};

/// A value, the amplitude that it follows, and the step that set it (0: before the first).
#[derive(Debug, Clone)]
pub(super) struct Given<T> {
    pub(super) value: T,
    pub(super) amplitude: Option<String>,
    pub(super) step: u32,
}

/// What is in force.
#[derive(Default)]
pub(super) struct State {
    held: BTreeMap<(u32, u8), Given<f64>>,
    kept: BTreeMap<(u32, u8), Given<f64>>,
    forces: BTreeMap<(u32, u8), Given<f64>>,
    pressures: BTreeMap<(u32, u8), Given<f64>>,
    pulls: BTreeMap<String, Given<(Vec<u32>, DVec3)>>,
    warm: BTreeMap<u32, Given<f64>>,
    temperatures: BTreeMap<u32, Given<f64>>,
    pub(super) heating: BTreeMap<Heated, Given<[f64; 2]>>,
    pub(super) step: u32,
    open: Option<Open>,
    /// When the steps before it ended.
    time: f64,
}

/// The step that is open.
struct Open {
    line: u32,
    duration: f64,
    perturbs: bool,
    procedure: Option<Procedure>,
}

impl State {
    /// Supports, forces and weights, each times what its amplitude says.
    fn loads(&self, factor: impl Fn(&Option<String>) -> Result<f64, Fault>) -> Result<Step, Fault> {
        let times = |all: &BTreeMap<(u32, u8), Given<f64>>| {
            let value = |(&key, g): (&(u32, u8), &Given<f64>)| {
                Ok::<_, Fault>((key, g.value * factor(&g.amplitude)?))
            };
            all.iter().map(value).collect::<Result<BTreeMap<_, _>, _>>()
        };
        let mut step = Step {
            name: format!("step {}", self.step),
            number: self.step,
            held: times(&self.held)?,
            kept: self.kept.keys().copied().collect(),
            forces: times(&self.forces)?,
            pressures: times(&self.pressures)?,
            ..Step::default()
        };
        for pull in self.pulls.values() {
            let factor = factor(&pull.amplitude)?;
            let (elements, pull) = &pull.value;
            step.pulls.extend(elements.iter().map(|&e| (e, factor * *pull)));
        }
        Ok(step)
    }

    /// Every step that began has ended, and there was one.
    pub(super) fn ended(&self) -> Result<(), Fault> {
        match &self.open {
            // CalculiX passes over a last step of which nothing stands there but its beginning.
            Some(open) if self.step <= 1 || open.procedure.is_some() => {
                Err(Fault::at(open.line, "*STEP without *END STEP: is the deck cut off?"))
            }
            Some(_) => Ok(()),
            None if self.step == 0 => Err(Fault::whole("no *STEP: there is nothing to compute")),
            None => Ok(()),
        }
    }
}

impl Reader {
    /// Everything that has an order.
    pub(super) fn history(&mut self, card: &Card<'_>, state: &mut State) -> Result<(), Fault> {
        let name = plain(card);
        const WITHIN: &str = "STATIC FREQUENCY BUCKLE HEATTRANSFER ENDSTEP CLOAD DLOAD DSLOAD \
            TEMPERATURE CFLUX DFLUX FILM RADIATE";
        if WITHIN.split_ascii_whitespace().any(|w| w == name) && state.open.is_none() {
            return Err(card.fault(format!("*{} must stand in a *STEP", card.name)));
        }
        match name.as_str() {
            "STEP" => begin(card, state),
            "STATIC" | "FREQUENCY" | "BUCKLE" | "HEATTRANSFER" => procedure(card, &name, state),
            "ENDSTEP" => self.close(state),
            "EQUATION" => self.end_equations(card, state),
            "BOUNDARY" => self.boundary(card, state),
            "CLOAD" => self.cload(card, state),
            "DLOAD" | "DSLOAD" => self.dload(card, state, name == "DSLOAD"),
            "TEMPERATURE" => self.temperature(card, state),
            "CFLUX" | "DFLUX" | "FILM" | "RADIATE" => self.heating(card, state),
            "INITIALCONDITIONS" => self.initial(card),
            "PHYSICALCONSTANTS" => self.constants(card),
            _ => Ok(()),
        }
    }

    fn close(&mut self, state: &mut State) -> Result<(), Fault> {
        let Some(open) = state.open.take() else { return Ok(()) };
        self.end(open.procedure.unwrap_or_default(), &open, state)?;
        state.time += open.duration;
        Ok(())
    }

    /// What is in force at the end of the step.
    fn end(&mut self, procedure: Procedure, open: &Open, state: &State) -> Result<(), Fault> {
        let &Open { line, duration, .. } = open;
        self.suits(procedure, line)?;
        let in_time = matches!(procedure, Procedure::Heat { steady: false, .. });
        let factor = |amplitude: &Option<String>| -> Result<f64, Fault> {
            let Some(name) = amplitude else { return Ok(1.0) };
            if in_time {
                let why =
                    "what heats over time is computed where it stays the same, without AMPLITUDE";
                return Err(Fault::at(line, why));
            }
            let amplitude = self.amplitude_of(name, line)?;
            let time = if amplitude.total_time { state.time + duration } else { duration };
            Ok(interpolate(&amplitude.points, time).unwrap_or(1.0))
        };
        let mut step = Step { procedure, ..state.loads(factor)? };
        if let Procedure::Heat { .. } = procedure {
            for (&node, given) in &state.temperatures {
                step.temperatures.insert(node, given.value * factor(&given.amplitude)?);
            }
            for (&heated, given) in &state.heating {
                let factor = factor(&given.amplitude)?;
                // The temperature beyond a face stays.
                step.heating.insert(heated, [given.value[0] * factor, given.value[1]]);
            }
        }
        if !state.warm.is_empty() {
            step.warm.clone_from(&self.deck.cold);
            for (&node, warm) in &state.warm {
                step.warm[node as usize] = warm.value * factor(&warm.amplitude)?;
            }
        }
        self.deck.steps.push(step);
        Ok(())
    }

    fn amplitude_of(&self, name: &str, line: u32) -> Result<&Amplitude, Fault> {
        let missing = || Fault::at(line, format!("amplitude {} is not defined", quote(name)));
        self.amplitudes.get(name).ok_or_else(missing)
    }
}

/// `OP=NEW` drops what earlier steps have left.
pub(super) fn clear<K: Ord, T>(
    card: &Card<'_>,
    step: u32,
    map: &mut BTreeMap<K, Given<T>>,
    concerns: impl Fn(&K) -> bool,
) -> Result<(), Fault> {
    match card.word("OP").as_deref() {
        None | Some("MOD") => {}
        Some("NEW") => map.retain(|k, g| g.step == step || !concerns(k)),
        Some(other) => {
            return Err(card.fault(format!("OP={}: MOD and NEW are supported", quote(other))));
        }
    }
    Ok(())
}
