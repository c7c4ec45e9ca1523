//! The tests of the program as a whole: they drive the real binary and look at what it wrote, with the real VTK.

mod boundaries;
mod check;
mod check_mesh;
mod corpus;
mod daemon;
mod doubts;
mod every_mesh;
mod fields;
mod fixtures;
mod foreign;
mod full;
mod fuzz;
mod interop;
mod invariants;
mod legality;
mod manifest;
mod mmg;
mod names;
mod opening;
mod packaging;
mod rooms;
mod run;
mod schedules;
mod support;
