//! The floor on which all other rooms stand: what planish asks of the operating system, and nothing of what it does with
//! meshes. It imports no other room.

pub mod disk;
pub mod escape;
pub mod fingerprint;
pub mod folder_checks;
mod lease;
pub mod machine;
pub mod orphans;
pub mod passing;
pub mod safe_open;
pub mod vitals;
