//! The output folder: how results are put in place ([`publish`]), which there are ([`ledger`]), how they go ([`withdraw`],
//! [`retention`]), and what is kept beside them in `OUT/.planish`.

pub mod begun;
pub mod free_space;
pub mod ledger;
pub mod listed;
pub mod own;
pub mod publish;
pub mod replace;
pub mod retention;
pub mod staging;
pub mod withdraw;
