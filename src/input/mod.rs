//! Which files are inputs, and what is read of them: from names on the command line, or in an inbox, to a soup.
//!
//! A [`job::Job`] names one input. Its bytes come from the file that was seen ([`read_input`]), are decoded by
//! the extension ([`decode()`]), and files that it names are looked for beside it and nowhere else ([`Folder`]).

mod collect;
mod decode;
pub mod job;
mod read;
mod siblings;

pub use collect::{InputError, collect, refuse_inside, refuse_same_names};
pub use decode::{MEMORY_PER_TRIANGLE, check_memory, decode};
pub use read::{Unread, hash_input, read_file, read_file_into, read_input};
pub use siblings::Folder;
