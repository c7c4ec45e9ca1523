//! The semaphore and the budget of the conveyor under thousands of orders of threads: no deadlock, no lost wake-up, never
//! more inside than there is room for. `cargo run --release --example schedules -- ORDERS`.
//!
//! The files are those of the program, with locks that shuttle schedules; orders are random, and by priorities that change
//! a few times (PCT: Burckhardt and co-workers 2010, doi 10.1145/1736020.1736040), which finds what needs few changes.
//! What is searched must be findable: where wake-ups are lost, a deadlock is found.

#[path = "../../../src/conveyor/budget.rs"]
#[allow(dead_code, missing_docs)]
mod budget;
#[path = "../../../src/conveyor/semaphore.rs"]
#[allow(dead_code, missing_docs)]
mod semaphore;
#[allow(missing_docs)]
mod sync;

/// What the files above take from the queue.
#[allow(missing_docs)]
mod queue {
    pub type Turn = u64;
    pub const LANES: usize = 3;
}

use budget::{Account, Budget};
use semaphore::PrioritySemaphore;
use shuttle::thread;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, AtomicUsize, Ordering};

/// Four computations for two places; each lets others pass on its way.
fn computations() {
    let (semaphore, inside) = (Arc::new(PrioritySemaphore::new(2)), Arc::new(AtomicUsize::new(0)));
    let compute = |turn: u64| {
        let (semaphore, inside) = (semaphore.clone(), inside.clone());
        move || {
            semaphore.enter(turn);
            assert!(inside.fetch_add(1, Ordering::SeqCst) < 2, "too many inside");
            inside.fetch_sub(1, Ordering::SeqCst);
            semaphore.yield_to(turn);
            semaphore.leave();
        }
    };
    let threads: Vec<_> = [30, 10, 20, 10].map(|turn| thread::spawn(compute(turn))).into();
    threads.into_iter().for_each(|thread| thread.join().expect("ends"));
}

/// Inputs hold memory while their factorisations wait for more, in places that they leave for that, as the conveyor does.
fn jobs() {
    let semaphore = Arc::new(PrioritySemaphore::new(1));
    let (budget, factors) = (Arc::new(Budget::new(100)), Arc::new(AtomicU64::new(0)));
    let job = |turn: u64, input: u64, factor: u64| {
        let (semaphore, budget, factors) = (semaphore.clone(), budget.clone(), factors.clone());
        move || {
            let lane = Account::Input(turn as usize % 2);
            budget.take(lane, input, turn);
            semaphore.enter(turn);
            if !budget.try_take(Account::Factor, factor) {
                semaphore.leave();
                budget.take(Account::Factor, factor, turn);
                semaphore.enter(turn);
            }
            let together = factors.fetch_add(factor, Ordering::SeqCst) + factor;
            assert!(together <= 100 || together == factor, "{together} bytes of factors");
            factors.fetch_sub(factor, Ordering::SeqCst);
            budget.give_back(Account::Factor, factor);
            semaphore.leave();
            budget.give_back(lane, input);
        }
    };
    let threads = [(1, 60, 70), (2, 80, 30), (3, 500, 10), (4, 10, 200)];
    let threads: Vec<_> = threads.map(|(turn, input, factor)| thread::spawn(job(turn, input, factor))).into();
    threads.into_iter().for_each(|thread| thread.join().expect("ends"));
}

fn main() {
    let orders = std::env::args().nth(1).and_then(|count| count.parse().ok()).unwrap_or(10_000);
    for scene in [computations, jobs] {
        shuttle::check_random(scene, orders);
        shuttle::check_pct(scene, orders, 3);
    }
    sync::LOSES_WAKE_UPS.store(true, Ordering::Relaxed);
    std::panic::set_hook(Box::new(|_| {}));
    let found = [computations, jobs]
        .map(|scene| catch_unwind(AssertUnwindSafe(|| shuttle::check_random(scene, orders))).is_err());
    assert!(found.contains(&true), "where wake-ups are lost, nothing is found: this has lost its sense");
    println!("{} orders of threads, none wrong; where wake-ups are lost, that is found: {found:?}", 4 * orders);
}
