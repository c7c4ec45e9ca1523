//! Charts that are divided again and again, until every piece is right.

use crate::atlas::Chart;
use crate::monitor::{Monitor, try_each};

/// How many triangles something has.
pub(super) trait Triangles {
    /// That number.
    fn triangles(&self) -> usize;
}

/// A chart, and what is known of it.
impl<T> Triangles for (Chart, T) {
    fn triangles(&self) -> usize {
        self.0.triangles().len()
    }
}

/// Something with its number.
impl<T: Triangles> Triangles for (usize, T) {
    fn triangles(&self) -> usize {
        self.1.triangles()
    }
}

impl Triangles for Chart {
    fn triangles(&self) -> usize {
        self.triangles().len()
    }
}

/// What `work` makes of each of `items`, in their order ([`try_each`]).
///
/// # Errors
/// That of the first item for which `work` fails.
pub(super) fn each<T: Triangles + Send, R: Send, E: Send>(
    items: Vec<T>,
    monitor: &dyn Monitor,
    work: impl Fn(T, &dyn Monitor) -> Result<R, E> + Sync,
) -> Result<Vec<R>, E> {
    let triangles = items.iter().map(Triangles::triangles).sum();
    try_each(monitor, items, triangles, work)
}

/// What becomes of a piece.
pub(super) enum Piece<T, R> {
    /// It is right.
    Done(R),
    /// Its own pieces, which have fewer triangles.
    Divided(Vec<T>),
}

/// A piece on its way.
enum Node<R> {
    Done(R),
    /// The numbers of its pieces.
    Divided(std::ops::Range<usize>),
    Waiting,
}

/// What becomes of `pieces`, in their order, with the pieces of each in its place, as long as so many of them `are_few`. Those of one
/// round are looked at at the same time, where the monitor has processors to spare. Ends because pieces have fewer triangles in every
/// round.
///
/// # Errors
/// Those of `look` and `are_few`.
pub(super) fn divided<T: Triangles + Send, R: Send, E: Send>(
    pieces: Vec<T>,
    monitor: &dyn Monitor,
    are_few: impl Fn(usize) -> Result<(), E>,
    look: impl Fn(T, &dyn Monitor) -> Result<Piece<T, R>, E> + Sync,
) -> Result<Vec<R>, E> {
    let roots = 0..pieces.len();
    let mut nodes: Vec<Node<R>> = pieces.iter().map(|_| Node::Waiting).collect();
    let mut leaves = nodes.len();
    let mut waiting: Vec<(usize, T)> = pieces.into_iter().enumerate().collect();
    while !waiting.is_empty() {
        are_few(leaves)?;
        let look = |(number, piece): (usize, T), monitor: &dyn Monitor| Ok((number, look(piece, monitor)?));
        for (number, piece) in each(std::mem::take(&mut waiting), monitor, look)? {
            nodes[number] = match piece {
                Piece::Done(result) => Node::Done(result),
                Piece::Divided(pieces) => {
                    let numbers = nodes.len()..nodes.len() + pieces.len();
                    leaves = leaves - 1 + pieces.len();
                    nodes.extend(pieces.iter().map(|_| Node::Waiting));
                    waiting.extend(numbers.clone().zip(pieces));
                    Node::Divided(numbers)
                }
            };
        }
    }
    let mut results = Vec::with_capacity(leaves);
    let mut next: Vec<usize> = roots.rev().collect();
    // Every node once: each is a piece of one other at most.
    while let Some(number) = next.pop() {
        match std::mem::replace(&mut nodes[number], Node::Waiting) {
            Node::Done(result) => results.push(result),
            Node::Divided(numbers) => next.extend(numbers.rev()),
            Node::Waiting => unreachable!("nothing waits any more"),
        }
    }
    Ok(results)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::monitor::NoMonitor;

    /// Numbers stand for pieces of as many triangles.
    impl Triangles for u32 {
        fn triangles(&self) -> usize {
            *self as usize
        }
    }

    /// Halves what is larger than three.
    fn halved(piece: u32, _: &dyn Monitor) -> Result<Piece<u32, u32>, &'static str> {
        match piece {
            0 => Err("nothing is left"),
            1..=3 => Ok(Piece::Done(piece)),
            _ => Ok(Piece::Divided(vec![piece - piece / 2, piece / 2])),
        }
    }

    #[test]
    fn pieces_stand_in_the_place_of_what_they_are_pieces_of() {
        let of = |pieces: &[u32], most: usize| {
            let are_few = |pieces| if pieces > most { Err("too many") } else { Ok(()) };
            divided(pieces.to_vec(), &NoMonitor, are_few, halved)
        };
        assert_eq!(of(&[5, 1, 9], 7), Ok(vec![3, 2, 1, 3, 2, 2, 2]));
        assert_eq!(of(&[5, 1, 9], 6), Err("too many"));
        assert_eq!(of(&[5, 0, 9], 99), Err("nothing is left"));
        assert_eq!(of(&[], 0), Ok(vec![]));
        // As deep as there are triangles.
        let peeled = |piece: u32, _: &dyn Monitor| {
            Ok::<_, ()>(if piece == 1 { Piece::Done(1) } else { Piece::Divided(vec![piece - 1, 1]) })
        };
        let ones = divided(vec![20_000_u32], &NoMonitor, |_| Ok(()), peeled);
        assert_eq!(ones.map(|ones| ones.len()), Ok(20_000));
    }
}
