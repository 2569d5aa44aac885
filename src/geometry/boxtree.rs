//! A hierarchy of boxes over numbered items: what rays, points and other hierarchies search.

use std::ops::ControlFlow;

use glam::DVec3;

use super::Bounds;

/// Items in a leaf; below this a split costs more than it saves.
const LEAF_ITEMS: usize = 4;
/// Candidate planes per axis for the surface-area heuristic.
const BINS: usize = 16;
/// Splits by cost on the way to a leaf; below them a split halves its items, so that 2³² items make no deeper tree than
/// `MAX_DEPTH`.
const COST_SPLITS: usize = 32;
/// Inner nodes on the way to a leaf, at most.
pub(crate) const MAX_DEPTH: usize = COST_SPLITS + 32;

/// A binary hierarchy of boxes, split by the surface-area heuristic over binned centres
/// (Wald 2007, doi:10.1109/RT.2007.4342588). Nodes lie in depth-first order: the left child follows its parent.
#[derive(Clone, Debug)]
pub struct BoxTree {
    nodes: Vec<Node>,
    items: Vec<u32>,
}

#[derive(Clone, Copy, Debug)]
struct Node {
    bounds: Bounds,
    /// Leaf: first item. Inner node: index of the right child.
    start: u32,
    /// Items in a leaf; 0 marks an inner node.
    count: u32,
}

/// A branch-and-bound search along a ray, see [`BoxTree::search`].
pub trait Search {
    /// A distance along the ray.
    type Distance: Copy + PartialOrd;

    /// Where the ray enters a box. `None` if it misses it, or beyond what is sought.
    fn entry(&self, bounds: &Bounds) -> Option<Self::Distance>;

    /// Whether something nearer than this was found.
    fn is_beyond(&self, entry: Self::Distance) -> bool;

    /// Looks at an item.
    fn item(&mut self, item: u32);
}

impl BoxTree {
    /// The hierarchy over `boxes`; item `i` is `boxes[i]`. Deterministic.
    pub fn build(boxes: &[Bounds]) -> Self {
        let mut items: Vec<u32> = (0..boxes.len() as u32).collect();
        let mut nodes = Vec::with_capacity(boxes.len());
        split(boxes, &mut items, 0, 0, PARALLEL_ITEMS, &mut nodes);
        Self { nodes, items }
    }

    /// The box around everything; empty if there are no items.
    pub fn bounds(&self) -> Bounds {
        self.nodes.first().map_or(Bounds::EMPTY, |n| n.bounds)
    }

    /// Whether there is nothing in it.
    pub fn is_empty(&self) -> bool {
        self.nodes.is_empty()
    }

    /// At most so many boxes, one at the least, that hold all items: those of one level of the hierarchy.
    pub fn parts(&self, at_most: usize) -> Vec<Bounds> {
        let mut level: Vec<u32> = self.nodes.first().map(|_| 0).into_iter().collect();
        loop {
            let below = |&node: &u32| self.children(node).map_or(vec![node], Vec::from);
            let next: Vec<u32> = level.iter().flat_map(below).collect();
            if next.len() == level.len() || next.len() > at_most {
                return level.into_iter().map(|node| self.bounds_of(node)).collect();
            }
            level = next;
        }
    }

    /// The box of a node; node 0 is the root.
    pub(crate) fn bounds_of(&self, node: u32) -> Bounds {
        self.nodes[node as usize].bounds
    }

    /// The children of an inner node. `None` for a leaf.
    pub(crate) fn children(&self, node: u32) -> Option<[u32; 2]> {
        let Node { start, count, .. } = self.nodes[node as usize];
        (count == 0).then_some([node + 1, start])
    }

    /// The items in all leaves under a node.
    pub(crate) fn items_under(&self, node: u32) -> &[u32] {
        let (mut left, mut right) = (node, node);
        while let Some([child, _]) = self.children(left) {
            left = child;
        }
        while let Some([_, child]) = self.children(right) {
            right = child;
        }
        let last = self.nodes[right as usize];
        &self.items[self.nodes[left as usize].start as usize..(last.start + last.count) as usize]
    }

    /// Bytes held.
    pub fn bytes(&self) -> usize {
        std::mem::size_of_val(&*self.nodes) + std::mem::size_of_val(&*self.items)
    }

    /// Calls `item` for each item in every leaf all of whose ancestors `enter` accepts.
    ///
    /// `enter` may grow stricter as items are seen, which makes this a branch-and-bound search.
    pub fn visit(&self, mut enter: impl FnMut(&Bounds) -> bool, mut item: impl FnMut(u32)) {
        let mut pending: Vec<u32> = Vec::with_capacity(MAX_DEPTH + 1);
        if !self.nodes.is_empty() {
            pending.push(0);
        }
        while let Some(index) = pending.pop() {
            let node = &self.nodes[index as usize];
            if !enter(&node.bounds) {
                continue;
            }
            if node.count == 0 {
                pending.push(node.start);
                pending.push(index + 1);
            } else {
                let range = node.start as usize..(node.start + node.count) as usize;
                self.items[range].iter().for_each(|&i| item(i));
            }
        }
    }

    /// The items of the leaf that is reached from the root by always taking the child whose box has the greater key.
    pub(crate) fn items_down_by(&self, key: impl Fn(&Bounds) -> f64) -> &[u32] {
        let Some(mut node) = self.nodes.first().map(|_| 0) else { return &[] };
        while let Some([left, right]) = self.children(node) {
            let key_of = |child: u32| key(&self.nodes[child as usize].bounds);
            node = if key_of(left) >= key_of(right) { left } else { right };
        }
        self.items_under(node)
    }

    /// Searches for the item nearest along a ray: nodes in the order in which the search enters them, children after
    /// their parent, those beyond what was found meanwhile left out.
    pub fn search<S: Search>(&self, search: &mut S) {
        let Some(entry) = self.nodes.first().and_then(|root| search.entry(&root.bounds)) else { return };
        let mut pending: Vec<(u32, S::Distance)> = Vec::with_capacity(MAX_DEPTH + 1);
        pending.push((0, entry));
        while let Some((index, entry)) = pending.pop() {
            if search.is_beyond(entry) {
                continue;
            }
            let node = &self.nodes[index as usize];
            if node.count > 0 {
                let range = node.start as usize..(node.start + node.count) as usize;
                self.items[range].iter().for_each(|&i| search.item(i));
                continue;
            }
            let [left, right] =
                [index + 1, node.start].map(|i| Some((i, search.entry(&self.nodes[i as usize].bounds)?)));
            let left_is_nearer = matches!((left, right), (Some(l), Some(r)) if l.1 < r.1);
            let [first, second] = if left_is_nearer { [right, left] } else { [left, right] };
            pending.extend(first);
            pending.extend(second);
        }
    }

    /// Calls `pair` for each pair of items (one of each hierarchy) in leaves whose boxes touch, until it breaks.
    pub fn overlapping_pairs<B>(
        &self,
        other: &Self,
        mut pair: impl FnMut(u32, u32) -> ControlFlow<B>,
    ) -> ControlFlow<B> {
        let mut pending = Vec::new();
        if !self.nodes.is_empty() && !other.nodes.is_empty() {
            pending.push((0u32, 0u32));
        }
        while let Some((i, j)) = pending.pop() {
            let (a, b) = (&self.nodes[i as usize], &other.nodes[j as usize]);
            if !a.bounds.touches(&b.bounds) {
                continue;
            }
            let a_is_larger = a.bounds.area() >= b.bounds.area();
            match (a.count, b.count) {
                (0, bc) if bc > 0 || a_is_larger => pending.extend([(a.start, j), (i + 1, j)]),
                (_, 0) => pending.extend([(i, b.start), (i, j + 1)]),
                _ => {
                    for &p in &self.items[a.start as usize..(a.start + a.count) as usize] {
                        for &q in &other.items[b.start as usize..(b.start + b.count) as usize] {
                            pair(p, q)?;
                        }
                    }
                }
            }
        }
        ControlFlow::Continue(())
    }
}

/// Items from which on the two sides of a split are built at the same time.
const PARALLEL_ITEMS: usize = 4096;

/// `parallel` is from how many items on it uses two threads.
fn split(
    boxes: &[Bounds],
    items: &mut [u32],
    first: usize,
    depth: usize,
    parallel: usize,
    nodes: &mut Vec<Node>,
) {
    if items.is_empty() {
        return;
    }
    let bounds = items.iter().fold(Bounds::EMPTY, |b, &i| b.union(boxes[i as usize]));
    let index = nodes.len();
    nodes.push(Node { bounds, start: first as u32, count: items.len() as u32 });
    if items.len() <= LEAF_ITEMS {
        return;
    }
    nodes[index].count = 0;
    let is_long = items.len() >= parallel;
    let middle = partition(boxes, items, depth < COST_SPLITS);
    let (left, right) = items.split_at_mut(middle);
    if is_long {
        let mut of_right = Vec::with_capacity(right.len());
        rayon::join(
            || split(boxes, left, first, depth + 1, parallel, nodes),
            || split(boxes, right, first + middle, depth + 1, parallel, &mut of_right),
        );
        // Those of the right side counted from 0.
        let offset = nodes.len() as u32;
        nodes[index].start = offset;
        nodes.extend(of_right.into_iter().map(|node| match node.count {
            0 => Node { start: node.start + offset, ..node },
            _ => node,
        }));
    } else {
        split(boxes, left, first, depth + 1, parallel, nodes);
        nodes[index].start = nodes.len() as u32;
        split(boxes, right, first + middle, depth + 1, parallel, nodes);
    }
}

/// Reorders `items` so that the cheapest split is at the returned place, strictly inside; the middle one unless
/// `by_cost`.
fn partition(boxes: &[Bounds], items: &mut [u32], by_cost: bool) -> usize {
    let centre = |i: u32| boxes[i as usize].centre();
    let centres = Bounds::of(items.iter().map(|&i| centre(i)));
    let extent = centres.size();
    let bin_of = |axis: usize, p: DVec3| -> usize {
        let x = (p[axis] - centres.min[axis]) / extent[axis];
        ((x * BINS as f64) as usize).min(BINS - 1)
    };

    let mut best: Option<(f64, usize, usize)> = None;
    for axis in (0..3).filter(|&a| by_cost && extent[a] > 0.0) {
        let mut bins = [(Bounds::EMPTY, 0usize); BINS];
        for &i in items.iter() {
            let bin = &mut bins[bin_of(axis, centre(i))];
            *bin = (bin.0.union(boxes[i as usize]), bin.1 + 1);
        }
        for cut in 1..BINS {
            let gather = |part: &[(Bounds, usize)]| {
                part.iter().fold((Bounds::EMPTY, 0), |(b, n), bin| (b.union(bin.0), n + bin.1))
            };
            let ((left, nl), (right, nr)) = (gather(&bins[..cut]), gather(&bins[cut..]));
            if nl == 0 || nr == 0 {
                continue;
            }
            let cost = left.area() * nl as f64 + right.area() * nr as f64;
            if best.is_none_or(|(least, ..)| cost < least) {
                best = Some((cost, axis, cut));
            }
        }
    }

    // A split that leaves nearly all on one side would make the tree as deep as it has items.
    let smallest_side = items.len() / 16;
    if let Some((_, axis, cut)) = best {
        let middle = stable_partition(items, |i| bin_of(axis, centre(i)) < cut);
        if middle.min(items.len() - middle) >= smallest_side.max(1) {
            return middle;
        }
    }
    let longest = if extent.x >= extent.y.max(extent.z) { 0 } else { 1 + usize::from(extent.z > extent.y) };
    items.sort_by(|&i, &j| centre(i)[longest].total_cmp(&centre(j)[longest]).then(i.cmp(&j)));
    items.len() / 2
}

/// Moves the items of which `is_first` holds before the others, keeping the order of both; returns how many they are.
fn stable_partition(items: &mut [u32], is_first: impl Fn(u32) -> bool) -> usize {
    let mut others = Vec::new();
    let mut count = 0;
    for at in 0..items.len() {
        let item = items[at];
        if is_first(item) {
            items[count] = item;
            count += 1;
        } else {
            others.push(item);
        }
    }
    items[count..].copy_from_slice(&others);
    count
}

#[cfg(test)]
mod tests {
    use rand::{RngExt, SeedableRng};

    use super::*;

    fn random_boxes(seed: u64, count: usize) -> Vec<Bounds> {
        let mut rng = rand_pcg::Pcg64::seed_from_u64(seed);
        let mut point = |scale: f64| scale * DVec3::new(rng.random(), rng.random(), rng.random());
        (0..count)
            .map(|_| {
                let min = point(100.0);
                Bounds { min, max: min + point(10.0) }
            })
            .collect()
    }

    #[test]
    fn visiting_a_window_finds_what_brute_force_finds() {
        let boxes = random_boxes(1, 500);
        let tree = BoxTree::build(&boxes);
        let window = Bounds { min: DVec3::splat(20.0), max: DVec3::splat(45.0) };
        let mut found = Vec::new();
        tree.visit(|b| b.touches(&window), |i| found.push(i));
        found.retain(|&i| boxes[i as usize].touches(&window));
        found.sort_unstable();
        let brute: Vec<u32> = (0..500).filter(|&i| boxes[i as usize].touches(&window)).collect();
        assert!(!brute.is_empty());
        assert_eq!(found, brute);
    }

    #[test]
    fn parts_hold_all_items_and_are_no_more_than_asked_for() {
        let boxes = random_boxes(5, 300);
        let tree = BoxTree::build(&boxes);
        for at_most in [1, 2, 10, 100, 1_000] {
            let parts = tree.parts(at_most);
            let holds = |part: &Bounds, item: &Bounds| part.union(*item) == *part;
            assert!((1..=at_most).contains(&parts.len()) && parts.len() > at_most.min(100) / 4);
            assert!(boxes.iter().all(|item| parts.iter().any(|part| holds(part, item))), "{at_most}");
        }
        assert!(BoxTree::build(&[]).parts(3).is_empty());
    }

    #[test]
    fn overlapping_pairs_are_those_of_brute_force() {
        let (a, b) = (random_boxes(2, 120), random_boxes(3, 90));
        let mut found = Vec::new();
        let _ = BoxTree::build(&a).overlapping_pairs(&BoxTree::build(&b), |i, j| {
            if a[i as usize].touches(&b[j as usize]) {
                found.push((i, j));
            }
            ControlFlow::<()>::Continue(())
        });
        found.sort_unstable();
        let all = (0..120u32).flat_map(|i| (0..90u32).map(move |j| (i, j)));
        let brute: Vec<_> = all.filter(|&(i, j)| a[i as usize].touches(&b[j as usize])).collect();
        assert_eq!(found, brute);
    }

    #[test]
    fn two_threads_build_what_one_builds() {
        let boxes = random_boxes(4, 2_000);
        let build = |parallel| {
            let (mut items, mut nodes): (Vec<u32>, _) = ((0..2_000).collect(), Vec::new());
            split(&boxes, &mut items, 0, 0, parallel, &mut nodes);
            let told: Vec<_> = nodes.iter().map(|node| (node.bounds, node.start, node.count)).collect();
            (items, told)
        };
        let alone = build(usize::MAX);
        for parallel in [2, 50, 1_500] {
            assert!(build(parallel) == alone, "{parallel}");
        }
    }

    #[test]
    fn ten_thousand_equal_boxes_do_not_overflow_the_stack() {
        let boxes = vec![Bounds { min: DVec3::ZERO, max: DVec3::ONE }; 10_000];
        let mut count = 0;
        BoxTree::build(&boxes).visit(|_| true, |_| count += 1);
        assert_eq!(count, 10_000);
    }
}
