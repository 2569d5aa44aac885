//! Contenders that take turns, so that whatever slows the machine for a while slows them all.

use super::Samples;
use crate::error::{Error, Result};
use crate::modes::Control;

/// How long a race goes on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Patience {
    /// Rounds at most.
    pub rounds: usize,
    /// A contender that has taken part in [`LEAST_ROUNDS`] leaves once it has run for so long, seconds.
    pub seconds: f64,
}

/// Fewer rounds make no median.
pub const LEAST_ROUNDS: usize = 3;

/// What came of a race: for each contender its laps' times, over the rounds that it took part in.
#[derive(Clone, Debug, PartialEq)]
pub struct Results<const LAPS: usize> {
    /// By contender, then by lap.
    pub times: Vec<[Samples; LAPS]>,
    /// Whether the race was stopped before its end.
    pub interrupted: bool,
}

/// Lets `contenders` run in turns; `run` does one contender's laps and says how long each took, seconds. The first round only
/// warms up and is not counted, unless `patience` asks for a single round.
///
/// # Errors
/// The first that `run` returns, but for an interruption, which ends the race with what there is.
pub fn race<const LAPS: usize>(
    contenders: usize,
    patience: Patience,
    control: &Control,
    mut run: impl FnMut(usize) -> Result<[f64; LAPS]>,
) -> Result<Results<LAPS>> {
    let mut times: Vec<[Samples; LAPS]> = vec![std::array::from_fn(|_| Samples::default()); contenders];
    let warm_up = usize::from(patience.rounds > 1);
    for round in 0..patience.rounds + warm_up {
        for contender in 0..contenders {
            let own = &mut times[contender];
            let spent: f64 = own.iter().flat_map(|lap| &lap.0).sum();
            if own.iter().all(|lap| lap.0.len() >= LEAST_ROUNDS) && spent > patience.seconds {
                control.advance(1);
                continue;
            }
            match control.check().and_then(|()| run(contender)) {
                Ok(laps) if round >= warm_up => {
                    own.iter_mut().zip(laps).for_each(|(lap, seconds)| lap.0.push(seconds));
                }
                Ok(_) => {}
                Err(Error::Interrupted) => return Ok(Results { times, interrupted: true }),
                Err(error) => return Err(error),
            }
            control.advance(1);
        }
    }
    Ok(Results { times, interrupted: false })
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::{AtomicBool, Ordering};

    use super::*;

    #[test]
    fn contenders_take_turns_and_the_slow_ones_leave_when_they_have_run_enough() {
        let mut order = Vec::new();
        let patience = Patience { rounds: 6, seconds: 1.0 };
        let results = race(2, patience, &Control::none(), |contender| {
            order.push(contender);
            Ok([if contender == 0 { 0.01 } else { 2.0 }])
        });
        let results = results.expect("a race");
        assert_eq!(&order[..6], &[0, 1, 0, 1, 0, 1]);
        assert_eq!(results.times[0][0].0.len(), 6);
        assert_eq!(results.times[1][0].0.len(), LEAST_ROUNDS, "the first round does not count");
        assert!(!results.interrupted);
    }

    #[test]
    fn an_interrupted_race_keeps_what_it_has() {
        let cancel = AtomicBool::new(false);
        let (mut runs, progress) = (0, |_| {});
        let patience = Patience { rounds: 9, seconds: 9.0 };
        let results = race(2, patience, &Control::new(&cancel, &progress), |_| {
            runs += 1;
            cancel.store(runs == 5, Ordering::Relaxed);
            Ok([1.0])
        });
        let results = results.expect("what there is");
        assert!(results.interrupted);
        assert_eq!(results.times.iter().map(|t| t[0].0.len()).collect::<Vec<_>>(), [2, 1]);
    }

    #[test]
    fn a_contenders_error_is_not_taken_for_an_interruption() {
        let refused = || Error::input("a", "b", "c");
        let patience = Patience { rounds: 2, seconds: 9.0 };
        assert!(race::<1>(1, patience, &Control::none(), |_| Err(refused())).is_err());
    }
}
