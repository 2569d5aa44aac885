//! Sums over the paths of a field, the same bits however a study is split.
//!
//! ```text
//!   blocks of a field    0   1   2   3   4   5   6            A block's sums are added up in the order of its paths;
//!                        ├───┤   ├───┤   ├───┤   │            blocks are added in a tree that the field alone decides.
//!                        ├───────┤       ├───────┤            A part of the blocks is a few of its nodes, which can be
//!                        └───────────────┘                    written down and joined with the others' later.
//! ```

use std::ops::AddAssign;

use serde::{Deserialize, Serialize};

/// Bins of a length histogram; the last holds all that is longer.
pub const MAX_BINS: usize = 10_000;

/// Of one organ, over paths.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct OrganSums {
    /// Paths that meet it.
    pub paths: u64,
    /// The photons they stand for.
    pub photons: f64,
    /// Σ photons · own length, mm.
    pub length: f64,
    /// Σ photons · μ·length at the reference energy.
    pub mu_length: f64,
    /// Σ photons · the mean energy of what a photon loses there, keV.
    pub removed: f64,
    /// Σ photons · the mean energy of what is absorbed there, keV.
    pub absorbed: f64,
    /// The shortest own length, mm.
    pub shortest_mm: f64,
    /// The longest.
    pub longest_mm: f64,
    /// The path of the longest: its number in the study.
    pub longest_path: u64,
    /// The area of the isocentre plane that leads to it, mm².
    pub area_mm2: f64,
    /// Its volume that is passed, mm³.
    pub volume_mm3: f64,
    /// By own length.
    pub bins: Vec<LengthBin>,
}

/// Of paths whose own lengths lie in one bin.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct LengthBin {
    /// How many.
    pub paths: u64,
    /// The area of the isocentre plane that they stand for, mm².
    pub area_mm2: f64,
    /// The organ's volume that they stand for, mm³.
    pub volume_mm3: f64,
}

/// One path's part in an organ's sums.
#[derive(Clone, Copy, Debug, Default)]
pub struct OrganPart {
    pub photons: f64,
    pub length_mm: f64,
    pub mu_length: f64,
    pub removed_kev: f64,
    pub absorbed_kev: f64,
    pub path: u64,
    pub area_mm2: f64,
    pub volume_mm3: f64,
}

impl OrganSums {
    /// Enters a path.
    pub fn add(&mut self, part: &OrganPart, bin_mm: f64) {
        self.extremes(part.length_mm, part.length_mm, part.path);
        self.paths += 1;
        self.photons += part.photons;
        self.length += part.photons * part.length_mm;
        self.mu_length += part.photons * part.mu_length;
        self.removed += part.photons * part.removed_kev;
        self.absorbed += part.photons * part.absorbed_kev;
        self.area_mm2 += part.area_mm2;
        self.volume_mm3 += part.volume_mm3;
        let bin = ((part.length_mm / bin_mm) as usize).min(MAX_BINS - 1);
        if bin >= self.bins.len() {
            self.bins.resize(bin + 1, LengthBin::default());
        }
        self.bins[bin] += LengthBin { paths: 1, area_mm2: part.area_mm2, volume_mm3: part.volume_mm3 };
    }

    fn extremes(&mut self, shortest_mm: f64, longest_mm: f64, path: u64) {
        if self.paths == 0 || shortest_mm < self.shortest_mm {
            self.shortest_mm = shortest_mm;
        }
        if self.paths == 0 || longest_mm > self.longest_mm {
            (self.longest_mm, self.longest_path) = (longest_mm, path);
        }
    }

    fn scaled(&self, photons: f64, space: f64) -> Self {
        let bin = |bin: &LengthBin| LengthBin {
            paths: bin.paths,
            area_mm2: space * bin.area_mm2,
            volume_mm3: space * bin.volume_mm3,
        };
        Self {
            photons: photons * self.photons,
            length: photons * self.length,
            mu_length: photons * self.mu_length,
            removed: photons * self.removed,
            absorbed: photons * self.absorbed,
            area_mm2: space * self.area_mm2,
            volume_mm3: space * self.volume_mm3,
            bins: self.bins.iter().map(bin).collect(),
            ..self.clone()
        }
    }
}

impl AddAssign for LengthBin {
    fn add_assign(&mut self, other: Self) {
        self.paths += other.paths;
        self.area_mm2 += other.area_mm2;
        self.volume_mm3 += other.volume_mm3;
    }
}

impl AddAssign<&Self> for OrganSums {
    fn add_assign(&mut self, other: &Self) {
        if other.paths > 0 {
            self.extremes(other.shortest_mm, other.longest_mm, other.longest_path);
        }
        self.paths += other.paths;
        self.photons += other.photons;
        self.length += other.length;
        self.mu_length += other.mu_length;
        self.removed += other.removed;
        self.absorbed += other.absorbed;
        self.area_mm2 += other.area_mm2;
        self.volume_mm3 += other.volume_mm3;
        if other.bins.len() > self.bins.len() {
            self.bins.resize(other.bins.len(), LengthBin::default());
        }
        for (bin, of_other) in self.bins.iter_mut().zip(&other.bins) {
            *bin += *of_other;
        }
    }
}

/// Of a field, or a part of it.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct FieldSums {
    /// Paths.
    pub paths: u64,
    /// Those that meet no organ.
    pub paths_meeting_nothing: u64,
    /// The photons they stand for.
    pub photons: f64,
    /// Σ photons · length, mm.
    pub length: f64,
    /// Σ photons · length outside every organ, mm.
    pub outside: f64,
    /// Σ photons · the share that is left at the path's end.
    pub transmitted: f64,
    /// Σ photons · the mean energy of what is left, keV.
    pub transmitted_energy: f64,
    /// Σ photons · transmission at the reference energy.
    pub transmitted_reference: f64,
    /// By organ.
    pub organs: Vec<OrganSums>,
}

impl FieldSums {
    /// No paths yet.
    pub fn new(organs: usize) -> Self {
        Self { organs: vec![OrganSums::default(); organs], ..Self::default() }
    }

    /// What a photon has of it: photons times `photons`, areas and volumes times `space`; lengths and numbers of paths stay.
    pub fn scaled(&self, photons: f64, space: f64) -> Self {
        Self {
            photons: photons * self.photons,
            length: photons * self.length,
            outside: photons * self.outside,
            transmitted: photons * self.transmitted,
            transmitted_energy: photons * self.transmitted_energy,
            transmitted_reference: photons * self.transmitted_reference,
            organs: self.organs.iter().map(|organ| organ.scaled(photons, space)).collect(),
            ..self.clone()
        }
    }
}

impl AddAssign<&Self> for FieldSums {
    fn add_assign(&mut self, other: &Self) {
        self.paths += other.paths;
        self.paths_meeting_nothing += other.paths_meeting_nothing;
        self.photons += other.photons;
        self.length += other.length;
        self.outside += other.outside;
        self.transmitted += other.transmitted;
        self.transmitted_energy += other.transmitted_energy;
        self.transmitted_reference += other.transmitted_reference;
        if other.organs.len() > self.organs.len() {
            self.organs.resize(other.organs.len(), OrganSums::default());
        }
        for (organ, of_other) in self.organs.iter_mut().zip(&other.organs) {
            *organ += of_other;
        }
    }
}

/// The sum of 2^`level` blocks, from block `index` · 2^`level` on.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Node<T> {
    /// How often two were added.
    pub level: u32,
    /// Its place among the nodes of its level.
    pub index: u64,
    /// The sum.
    pub sum: T,
}

/// Nodes of neighbouring blocks, as few as there can be.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Nodes<T>(pub Vec<Node<T>>);

impl<T> Default for Nodes<T> {
    fn default() -> Self {
        Self(Vec::new())
    }
}

impl<T: for<'t> AddAssign<&'t T>> Nodes<T> {
    /// Adds the next node: a block (level 0), or one of another part of the study.
    pub fn push(&mut self, mut node: Node<T>) {
        while let Some(last) = self.0.last()
            && last.level == node.level
            && last.index % 2 == 0
            && last.index + 1 == node.index
            && let Some(mut left) = self.0.pop()
        {
            left.sum += &node.sum;
            node = Node { level: node.level + 1, index: node.index / 2, sum: left.sum };
        }
        self.0.push(node);
    }

    /// The sum of all, the later nodes, which are smaller, first. `None` of none.
    pub fn total(self) -> Option<T> {
        self.0.into_iter().rev().map(|node| node.sum).reduce(|right, mut left| {
            left += &right;
            left
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Values whose sum depends on the order of additions.
    fn values(count: usize) -> Vec<f64> {
        (0..count).map(|i| 1.0 / (3.0 + i as f64).powi(2) * if i % 3 == 0 { 1e9 } else { 1.0 }).collect()
    }

    #[derive(Clone, Debug, PartialEq)]
    struct Number(f64);

    impl AddAssign<&Self> for Number {
        fn add_assign(&mut self, other: &Self) {
            self.0 += other.0;
        }
    }

    fn nodes(values: &[f64], from: u64) -> Nodes<Number> {
        let mut nodes = Nodes::default();
        for (index, value) in (from..).zip(values) {
            nodes.push(Node { level: 0, index, sum: Number(*value) });
        }
        nodes
    }

    #[test]
    fn parts_join_to_the_same_bits_wherever_they_were_cut() {
        let values = values(317);
        let whole = nodes(&values, 0);
        assert!(whole.0.len() <= 9);
        for cuts in [[1, 2], [100, 101], [128, 256], [7, 300]] {
            let mut joined = Nodes::default();
            for range in [0..cuts[0], cuts[0]..cuts[1], cuts[1]..317] {
                let part = nodes(&values[range.clone()], range.start as u64);
                assert!(part.0.len() <= 17);
                part.0.into_iter().for_each(|node| joined.push(node));
            }
            assert_eq!(joined, whole, "{cuts:?}");
        }
        let total = whole.total().expect("a sum").0;
        let plain: f64 = values.iter().sum();
        assert!((total / plain - 1.0).abs() < 1e-14, "{total} {plain}");
    }

    #[test]
    fn sums_keep_extremes_and_histograms() {
        let part = |path, length_mm| OrganPart {
            photons: 2.0,
            length_mm,
            path,
            area_mm2: 1.0,
            ..OrganPart::default()
        };
        let mut sums = [OrganSums::default(), OrganSums::default()];
        sums[0].add(&part(3, 12.0), 5.0);
        sums[1].add(&part(5, 7.5), 5.0);
        sums[1].add(&part(6, 12.0), 5.0);
        let [mut all, other] = sums;
        all += &other;
        assert_eq!(
            (all.paths, all.length, all.shortest_mm, all.longest_mm, all.longest_path),
            (3, 63.0, 7.5, 12.0, 3)
        );
        assert_eq!(all.bins.iter().map(|bin| bin.paths).collect::<Vec<_>>(), [0, 1, 2]);
    }

    #[test]
    fn what_is_written_as_json_comes_back_to_the_last_bit() {
        let mut sums = FieldSums::new(1);
        sums.photons = values(50).iter().sum();
        sums.organs[0]
            .add(&OrganPart { photons: 0.1 + 0.2, length_mm: 1.0 / 3.0, ..OrganPart::default() }, 5.0);
        let text = serde_json::to_string(&sums).expect("JSON");
        assert_eq!(serde_json::from_str::<FieldSums>(&text).expect("JSON"), sums);
    }
}
