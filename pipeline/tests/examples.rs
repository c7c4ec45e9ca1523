//! The programs in examples/ do what they say.

#[path = "../examples/map_a_soup.rs"]
mod map_a_soup;
#[path = "../examples/measure_a_map.rs"]
mod measure_a_map;
#[path = "../examples/prove_a_foreign_map.rs"]
mod prove_a_foreign_map;

#[test]
fn a_soup_is_mapped() {
    map_a_soup::main().expect("it ends well");
}

#[test]
fn a_map_is_measured() {
    measure_a_map::main().expect("it ends well");
}

#[test]
fn a_foreign_map_is_proven_and_broken_ones_are_not() {
    prove_a_foreign_map::main().expect("it ends well");
}
