//! Compressed rows: many short lists in one array, and the sort that makes them.

/// Lists of items (rows), one after the other in one array, with the place where each begins.
///
/// This is what the stars of vertices, the sides of edges, the links of a graph and the rows of a sparse matrix have in
/// common. Two allocations hold any number of rows.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Csr<T> {
    /// The place of the first item of each row, and the number of items.
    starts: Vec<u32>,
    items: Vec<T>,
}

impl<T> Default for Csr<T> {
    fn default() -> Self {
        Self { starts: vec![0], items: Vec::new() }
    }
}

impl<T> Csr<T> {
    /// No rows yet, with room for so many items.
    pub(crate) fn with_capacity(items: usize) -> Self {
        Self { starts: vec![0], items: Vec::with_capacity(items) }
    }

    /// Adds a row after the last one.
    pub(crate) fn push_row(&mut self, items: impl IntoIterator<Item = T>) {
        self.items.extend(items);
        self.close_row();
    }

    /// Adds an item to the row that is being made, the one that [`Self::close_row`] ends.
    pub(crate) fn push(&mut self, item: T) {
        self.items.push(item);
    }

    /// The items pushed since the last row was closed.
    pub(crate) fn open_row(&self) -> &[T] {
        &self.items[self.starts[self.len()] as usize..]
    }

    /// Makes a row of all items pushed since the last one was closed.
    pub(crate) fn close_row(&mut self) {
        self.starts.push(self.items.len() as u32);
    }

    /// The number of rows.
    pub(crate) fn len(&self) -> usize {
        self.starts.len() - 1
    }

    /// The items of a row.
    pub(crate) fn row(&self, row: usize) -> &[T] {
        &self.items[self.range(row)]
    }

    /// The items of a row.
    pub(crate) fn row_mut(&mut self, row: usize) -> &mut [T] {
        let range = self.range(row);
        &mut self.items[range]
    }

    /// The rows, in order.
    pub(crate) fn rows(&self) -> impl Iterator<Item = &[T]> {
        (0..self.len()).map(|row| self.row(row))
    }

    fn range(&self, row: usize) -> std::ops::Range<usize> {
        self.starts[row] as usize..self.starts[row + 1] as usize
    }
}

impl<T: Clone + Default> Csr<T> {
    /// As many default items in each row as `lengths` tells.
    pub(crate) fn of_lengths(lengths: &[u32]) -> Self {
        let mut starts = Vec::with_capacity(lengths.len() + 1);
        let mut end = 0;
        starts.push(end);
        for length in lengths {
            end += length;
            starts.push(end);
        }
        Self { starts, items: vec![T::default(); end as usize] }
    }

    /// Sorts items, each with the row it belongs to, into `rows` rows, where they keep their order: a counting sort, in
    /// time linear in the number of rows and items. `items` is asked for the same items twice.
    pub(crate) fn sorted<I: Iterator<Item = (u32, T)>>(rows: usize, items: impl Fn() -> I) -> Self {
        let mut lengths = vec![0_u32; rows];
        for (row, _) in items() {
            lengths[row as usize] += 1;
        }
        let mut sorted = Self::of_lengths(&lengths);
        // Per row, the place of its next item.
        let mut next = sorted.starts.clone();
        for (row, item) in items() {
            let place = &mut next[row as usize];
            sorted.items[*place as usize] = item;
            *place += 1;
        }
        sorted
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn items_keep_their_order_in_their_rows() {
        let items = [(2, 'a'), (0, 'b'), (2, 'c'), (2, 'a'), (0, 'd')];
        let mut sorted = Csr::sorted(4, || items.into_iter());
        let rows: Vec<String> = sorted.rows().map(|row| row.iter().collect()).collect();
        assert_eq!(rows, ["bd", "", "aca", ""]);
        sorted.row_mut(2).sort_unstable();
        assert_eq!((sorted.row(2), sorted.row(3)), (&['a', 'a', 'c'][..], &[][..]));
    }

    #[test]
    fn rows_are_pushed_whole_or_item_by_item() {
        let mut whole = Csr::default();
        whole.push_row([1, 2]);
        whole.push_row([]);
        whole.push_row([3]);
        let mut single = Csr::with_capacity(3);
        single.push(1);
        single.push(2);
        assert_eq!(single.open_row(), [1, 2]);
        single.close_row();
        assert!(single.open_row().is_empty());
        single.close_row();
        single.push(3);
        single.close_row();
        assert_eq!((whole.len(), &whole), (3, &single));
    }

    #[test]
    fn rows_of_given_lengths_hold_defaults() {
        let filled: Csr<u8> = Csr::of_lengths(&[2, 0, 1]);
        assert_eq!(filled.rows().collect::<Vec<_>>(), [&[0, 0][..], &[], &[0]]);
    }
}
