//! Items in buckets: a sort by small numbers in time linear in their count.

/// Items by bucket, in each one in the order in which they came.
pub(crate) struct Buckets<T> {
    starts: Vec<u32>,
    items: Vec<T>,
}

impl<T: Copy + Default> Buckets<T> {
    /// Sorts items, each with the bucket it belongs to, into `count` buckets.
    pub(crate) fn new<I: Iterator<Item = (u32, T)>>(count: usize, items: impl Fn() -> I) -> Self {
        let mut starts = vec![0_u32; count + 1];
        items().for_each(|(bucket, _)| starts[bucket as usize + 1] += 1);
        (0..count).for_each(|b| starts[b + 1] += starts[b]);
        let mut sorted = vec![T::default(); starts[count] as usize];
        let mut next = starts.clone();
        for (bucket, item) in items() {
            sorted[next[bucket as usize] as usize] = item;
            next[bucket as usize] += 1;
        }
        Self { starts, items: sorted }
    }

    /// The items of a bucket.
    pub(crate) fn get_mut(&mut self, bucket: usize) -> &mut [T] {
        &mut self.items[self.starts[bucket] as usize..self.starts[bucket + 1] as usize]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn items_keep_their_order_in_their_buckets() {
        let items = [(2, 'a'), (0, 'b'), (2, 'c'), (2, 'a'), (0, 'd')];
        let mut buckets = Buckets::new(4, || items.into_iter());
        let all = [0, 1, 2, 3].map(|b| buckets.get_mut(b).iter().collect::<String>());
        assert_eq!(all, ["bd", "", "aca", ""]);
    }
}
