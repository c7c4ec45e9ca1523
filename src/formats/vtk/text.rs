//! Words and numbers of text, with the place of what is wrong.

use super::error::{Location, VtkError, escape};
use crate::formats::words::{float, remedy};
use planish_core::vec3::Vec3;

/// Text of a file, read from its front.
#[derive(Clone, Debug)]
pub(super) struct Text<'a> {
    /// The file up to the end of the text.
    pub bytes: &'a [u8],
    /// The first byte that is not read yet.
    pub at: usize,
}

impl<'a> Text<'a> {
    /// What is not read yet.
    pub fn rest(&self) -> &'a [u8] {
        &self.bytes[self.at..]
    }

    /// The line that is read.
    pub fn location(&self) -> Location {
        Location::line_of(self.bytes, self.at)
    }

    /// Passes over blanks and ends of lines.
    pub fn blanks(&mut self) {
        let rest = self.rest();
        self.at += rest.len() - rest.trim_ascii_start().len();
    }

    /// The next word.
    pub fn word(&mut self) -> Option<&'a [u8]> {
        self.blanks();
        let rest = self.rest();
        let end = rest.iter().position(u8::is_ascii_whitespace).unwrap_or(rest.len());
        let word = &rest[..end];
        self.at += word.len();
        (!word.is_empty()).then_some(word)
    }

    /// How many words are left.
    pub fn words(mut self) -> u64 {
        let mut words = 0;
        while self.word().is_some() {
            words += 1;
        }
        words
    }

    /// The rest of the line, without its end; none at the end of the text.
    pub fn line(&mut self) -> Option<&'a [u8]> {
        let rest = self.rest();
        let line = rest.split_inclusive(|b| *b == b'\n').next()?;
        self.at += line.len();
        Some(line.trim_ascii_end())
    }

    /// The error that something makes no sense here.
    pub fn syntax(&self, problem: impl Into<String>) -> VtkError {
        VtkError::Syntax { location: self.location(), problem: problem.into() }
    }

    /// Text may hold so many numbers: each takes a blank and a digit.
    pub fn expect(&self, what: &str, declared: u64) -> Result<(), VtkError> {
        let there = (self.rest().len() as u64).div_ceil(2);
        if declared <= there {
            return Ok(());
        }
        Err(VtkError::Count { location: self.location(), what: what.to_owned(), declared, there })
    }

    /// This many points.
    pub fn points(&mut self, what: &str, count: u64) -> Result<Vec<Vec3>, VtkError> {
        let declared = count.saturating_mul(3);
        self.expect(what, declared)?;
        let mut points = vec![[0.0; 3]; count as usize];
        for (there, coordinate) in (0..).zip(points.as_flattened_mut()) {
            let Some(word) = self.word() else { return Err(self.count(what, declared, there)) };
            let Some(number) = float(word) else {
                return Err(self.syntax(format!("\"{}\" is no coordinate of {what}{}", escape(word), remedy(word))));
            };
            *coordinate = number;
        }
        Ok(points)
    }

    /// This many ids.
    pub fn ids(&mut self, what: &str, count: u64) -> Result<Vec<u32>, VtkError> {
        self.expect(what, count)?;
        let mut ids = vec![0; count as usize];
        for (there, id) in (0..).zip(&mut ids) {
            let Some(word) = self.word() else { return Err(self.count(what, count, there)) };
            let number = std::str::from_utf8(word).ok().and_then(|w| w.parse().ok());
            *id = number.ok_or_else(|| self.syntax(format!("\"{}\" is no whole number of {what}", escape(word))))?;
        }
        Ok(ids)
    }

    /// This many values of an array, each of a word.
    pub fn values<T>(
        &mut self,
        what: &str,
        count: u64,
        mut value: impl FnMut(&[u8]) -> Option<T>,
    ) -> Result<Vec<T>, VtkError> {
        self.expect(what, count)?;
        let mut values = Vec::with_capacity(count as usize);
        for there in 0..count {
            let Some(word) = self.word() else { return Err(self.count(what, count, there)) };
            let bad = || self.syntax(format!("\"{}\" is no value of {what}", escape(word)));
            values.push(value(word).ok_or_else(bad)?);
        }
        Ok(values)
    }

    fn count(&self, what: &str, declared: u64, there: u64) -> VtkError {
        VtkError::Count { location: self.location(), what: what.to_owned(), declared, there }
    }
}

/// The whole number that a word is, of whatever type.
pub(super) fn whole(word: &[u8]) -> Option<i128> {
    std::str::from_utf8(word).ok()?.parse().ok()
}
