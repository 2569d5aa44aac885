//! From the binary tree of a surface's faces to a wide one (Wald, Benthin & Boulos 2008,
//! doi:10.1109/RT.2008.4634620): the largest box among a node's children is opened until they are eight.

use super::local::Frame;
use super::node::{Child, LANES, Leaf, Node};
use crate::geometry::{Bounds, BoxTree, ClosedMesh};

/// The wide tree under construction.
pub(super) struct Builder<'a> {
    surface: &'a ClosedMesh,
    frame: Frame,
    pub nodes: Vec<Node>,
    pub leaves: Vec<Leaf>,
}

impl<'a> Builder<'a> {
    /// Builds the tree over the faces of `surface`. Node 0 is its root.
    pub fn build(surface: &'a ClosedMesh, frame: Frame) -> Self {
        let mut builder = Self { surface, frame, nodes: Vec::new(), leaves: Vec::new() };
        builder.add_node(0);
        builder
    }

    fn tree(&self) -> &'a BoxTree {
        self.surface.tree()
    }

    fn add_node(&mut self, root: u32) -> Child {
        let index = self.nodes.len();
        self.nodes.push(Node::EMPTY);
        for (lane, child) in self.opened(root).into_iter().enumerate() {
            let bounds = self.in_frame(self.tree().bounds_of(child));
            let child =
                if self.is_leaf(child) { self.add_leaf(child, &bounds) } else { self.add_node(child) };
            self.nodes[index].set(lane, &bounds, child);
        }
        Child::node(index)
    }

    /// The children of a wide node: the binary nodes under `root` that remain closed.
    fn opened(&self, root: u32) -> Vec<u32> {
        let mut children = vec![root];
        while children.len() < LANES {
            let area = |&i: &usize| self.tree().bounds_of(children[i]).area();
            let inner = (0..children.len()).filter(|&i| !self.is_leaf(children[i]));
            let Some(largest) = inner.max_by(|i, j| area(i).total_cmp(&area(j))) else { break };
            let Some([left, right]) = self.tree().children(children[largest]) else { break };
            children[largest] = left;
            children.push(right);
        }
        children
    }

    /// Whether the faces under a binary node are few enough for one leaf.
    fn is_leaf(&self, node: u32) -> bool {
        self.tree().items_under(node).len() <= LANES
    }

    fn add_leaf(&mut self, node: u32, bounds: &Bounds) -> Child {
        let corners = |face: u32| {
            self.surface.mesh().triangle(face as usize).map(|corner| self.frame.place(corner).to_array())
        };
        let leaf = Leaf::of(self.tree().items_under(node), corners, bounds.size().max_element());
        self.leaves.push(leaf);
        Child::leaf(self.leaves.len() - 1)
    }

    fn in_frame(&self, bounds: Bounds) -> Bounds {
        Bounds { min: self.frame.place(bounds.min), max: self.frame.place(bounds.max) }
    }
}
