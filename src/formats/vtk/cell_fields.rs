//! Which cells of a file the triangles of its surface belong to.

use super::cell_labels::PieceCells;

/// Per triangle of these pieces the number of its cell, counted from 0 over all cells of the file; nothing where no cell was cut
/// into several triangles.
pub(super) fn cut_cells(pieces: &[PieceCells]) -> Vec<i64> {
    let mut numbers = Vec::new();
    let mut before: u64 = 0;
    for piece in pieces {
        // What a file declares may be any number; that of a cell with triangles is none too large.
        let number = |cell: usize| i64::try_from(before.saturating_add(cell as u64)).unwrap_or(i64::MAX);
        numbers.extend(piece.of_triangles().map(number));
        before = before.saturating_add(piece.count());
    }
    // The triangles of a cell follow each other.
    let are_cut = numbers.windows(2).any(|pair| pair[0] == pair[1]);
    if are_cut { numbers } else { Vec::new() }
}

#[cfg(test)]
mod tests {
    use super::super::cell_labels::Rank;
    use super::*;

    #[test]
    fn cells_are_counted_over_all_pieces_in_the_order_of_their_arrays() {
        // Of polygons, the first gives two triangles and the second none. Strips and lines stand before them in the file.
        let mut first = PieceCells::default();
        first.add(Rank::Strips, 0, vec![1]);
        first.skip(Rank::Lines, 2);
        first.add(Rank::Polygons, 1, vec![3, 3, 4]);
        assert_eq!(first.count(), 6);
        assert_eq!(first.of_triangles().collect::<Vec<_>>(), [5, 2, 2, 4]);
        let mut second = PieceCells::default();
        second.add(Rank::First, 4, vec![5]);
        assert_eq!(cut_cells(&[first, second.clone()]), [5, 2, 2, 4, 6]);
        assert_eq!(cut_cells(&[second]), [0_i64; 0]);
    }
}
