//! The paper's own figures, from the table beside this file, which names its source.

use serde::Serialize;

use super::Input;
use crate::ritree::Parameters;

const TABLE: &str = include_str!("published.csv");

/// What the paper found at one setting.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Published {
    /// Operations of rays traced one by one over operations with trees.
    pub flop_speed_up: f64,
    /// Seconds likewise.
    pub cpu_speed_up: f64,
    /// Its mean error, see [`Input::error_unit`].
    pub error: f64,
    /// Megabytes of the trees, where they are told.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub memory_mb: Option<f64>,
}

impl Published {
    /// The paper's figures for a scene at these parameters, with a cache that holds all. `None` if it gives none.
    pub fn find(input: Input, parameters: &Parameters) -> Option<Self> {
        rows().find(|(name, row, _)| *name == input.name() && row == parameters).map(|(_, _, found)| found)
    }
}

fn rows() -> impl Iterator<Item = (&'static str, Parameters, Published)> {
    let lines = TABLE.lines().filter(|line| !line.starts_with('#')).skip(1);
    lines.filter_map(|line| {
        let mut fields = line.split(',');
        let name = fields.next()?;
        let mut number = || fields.next().and_then(|field| field.parse::<f64>().ok());
        let parameters = Parameters {
            distance_threshold: number()?,
            angular_threshold_deg: number()?,
            max_depth: number()? as u32,
        };
        let (flop_speed_up, cpu_speed_up, error) = (number()?, number()?, number()?);
        Some((name, parameters, Published { flop_speed_up, cpu_speed_up, error, memory_mb: number() }))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_line_is_read_and_belongs_to_a_scene() {
        let lines = TABLE.lines().filter(|line| !line.starts_with('#') && !line.is_empty()).count() - 1;
        assert_eq!(rows().count(), lines);
        for (name, parameters, found) in rows() {
            let input = Input::ALL.into_iter().find(|input| input.name() == name).expect("a scene");
            assert_eq!(
                Published::find(input, &parameters),
                Some(found),
                "one line for {name} {parameters:?}"
            );
            assert!(found.flop_speed_up > 1.0 && found.cpu_speed_up > 1.0 && found.error > 0.0);
        }
    }

    #[test]
    fn the_papers_usual_setting_has_its_figures() {
        let found = Published::find(Input::BezierSurface, &Parameters::default()).expect("a row");
        assert_eq!((found.flop_speed_up, found.error, found.memory_mb), (3.74473, 0.00676, Some(1.931)));
        assert_eq!(Published::find(Input::Adult, &Parameters::default()), None);
    }
}
