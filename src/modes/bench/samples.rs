//! Times of several rounds, and what is said of them.

use serde::Serialize;

/// Times of one task by round, seconds.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Samples(pub Vec<f64>);

/// Half the distance between the quartiles beyond which times are called unsteady, as a share of the median.
pub const STEADY: f64 = 0.1;

impl Samples {
    /// The median. NaN if there are none.
    pub fn median(&self) -> f64 {
        quantile(&self.0, 0.5)
    }

    /// Half the distance between the quartiles, as a share of the median.
    pub fn spread(&self) -> f64 {
        0.5 * (quantile(&self.0, 0.75) - quantile(&self.0, 0.25)) / self.median()
    }

    /// How many times as long as `other` it took: the median over the rounds both took part in, whose drift they share.
    pub fn ratio_to(&self, other: &Self) -> f64 {
        self.ratios_to(other).median()
    }

    /// The ratio of each round.
    pub fn ratios_to(&self, other: &Self) -> Self {
        Self(self.0.iter().zip(&other.0).map(|(a, b)| a / b).collect())
    }

    /// Summed up.
    pub fn times(&self) -> Times {
        let spread = self.spread();
        Times {
            seconds: self.median(),
            least: quantile(&self.0, 0.0),
            most: quantile(&self.0, 1.0),
            spread,
            rounds: self.0.len(),
            unsteady: spread > STEADY,
        }
    }
}

/// What the times of several rounds amount to.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Times {
    /// The median, seconds.
    pub seconds: f64,
    /// The shortest, seconds.
    pub least: f64,
    /// The longest, seconds.
    pub most: f64,
    /// Half the distance between the quartiles, as a share of the median.
    pub spread: f64,
    /// How many rounds.
    pub rounds: usize,
    /// Whether the spread is over a tenth: something else may have used the machine.
    pub unsteady: bool,
}

/// Linear between the sorted values.
fn quantile(values: &[f64], share: f64) -> f64 {
    let mut sorted = values.to_vec();
    sorted.sort_unstable_by(f64::total_cmp);
    let Some(last) = sorted.len().checked_sub(1) else { return f64::NAN };
    let place = share * last as f64;
    let (low, high) = (place.floor(), place.ceil());
    let (a, b) = (sorted[low as usize], sorted[high as usize]);
    a + (place - low) * (b - a)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_rounds_drift_is_in_no_ratio() {
        let (a, b) = (Samples(vec![2.0, 20.0, 4.0]), Samples(vec![1.0, 10.0, 2.0]));
        assert_eq!((a.median(), a.ratio_to(&b)), (4.0, 2.0));
        assert_eq!(Samples(vec![1.0, 2.0, 3.0, 4.0, 5.0]).spread(), 1.0 / 3.0);
        assert!(Samples::default().median().is_nan());
    }

    #[test]
    fn unsteady_times_are_called_so() {
        let steady = Samples(vec![1.0, 1.01, 0.99, 5.0, 1.02]).times();
        assert_eq!((steady.seconds, steady.least, steady.most, steady.rounds), (1.01, 0.99, 5.0, 5));
        assert!(!steady.unsteady, "one outlier moves no quartile");
        assert!(Samples(vec![1.0, 2.0, 3.0]).times().unsteady);
    }
}
