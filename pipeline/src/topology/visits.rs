//! Marks of what a walk has visited, cleared without touching them.

/// Which of `0..len` a walk has visited. A new walk begins in constant time: a mark counts only while it bears the number of
/// the present walk, so that walks over a small part of a large surface cost no more than that part.
#[derive(Clone, Debug)]
pub(crate) struct VisitStamps {
    walk: u32,
    last: Vec<u32>,
}

impl VisitStamps {
    /// Stamps for `len` elements, none of which is visited.
    pub(crate) fn new(len: usize) -> Self {
        Self { walk: 1, last: vec![0; len] }
    }

    /// Begins a new walk: nothing is visited.
    pub(crate) fn clear(&mut self) {
        // When the numbers begin again, old marks must not count for new walks.
        self.walk = self.walk.checked_add(1).unwrap_or_else(|| {
            self.last.fill(0);
            1
        });
    }

    /// Visits an element; whether that was the first time since [`Self::clear`].
    pub(crate) fn visit(&mut self, index: usize) -> bool {
        std::mem::replace(&mut self.last[index], self.walk) != self.walk
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_walk_visits_everything_anew() {
        let mut stamps = VisitStamps::new(3);
        for _ in 0..2 {
            assert!(stamps.visit(2) && stamps.visit(0));
            assert!(!stamps.visit(2) && !stamps.visit(0));
            stamps.clear();
        }
    }

    #[test]
    fn the_number_of_walks_is_not_bounded() {
        let mut stamps = VisitStamps::new(2);
        assert!(stamps.visit(0));
        stamps.walk = u32::MAX;
        assert!(stamps.visit(1));
        stamps.clear();
        assert!(stamps.visit(0) && stamps.visit(1), "the stamps of the first walk do not come back");
    }
}
