//! The format's lines: a key, and what is behind it.

use crate::roadmap::MapError;

/// One line that says something.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Line<'a> {
    /// Counted from 1.
    pub(super) number: usize,
    /// As the file has it.
    whole: &'a str,
    /// Of the key, in bytes.
    offset: usize,
    pub(super) key: &'a str,
    /// Trimmed.
    pub(super) rest: &'a str,
    /// Of the rest, in bytes.
    rest_offset: usize,
}

impl Line<'_> {
    /// An error at the key.
    pub(super) fn error(&self, problem: impl Into<String>) -> MapError {
        MapError {
            line: self.number,
            column: column(self.whole, self.offset),
            problem: problem.into(),
        }
    }

    /// An error at what is behind the key.
    pub(super) fn rest_error(&self, problem: impl Into<String>) -> MapError {
        MapError {
            column: column(self.whole, self.rest_offset),
            ..self.error(problem)
        }
    }
}

/// What comments of ours begin with.
pub(super) const OURS: &str = "kreisel:";

/// The lines of a file, without comments but for our own, whose content counts.
pub(super) struct Lines<'a> {
    lines: Vec<Line<'a>>,
    next: usize,
    /// Of the file.
    count: usize,
}

impl<'a> Lines<'a> {
    /// # Errors
    /// A comment that does not end.
    pub(super) fn of(text: &'a str) -> Result<Self, MapError> {
        let mut lines = vec![];
        let mut comment: Option<Comment<'_>> = None;
        let mut count = 0;
        for (index, whole) in text.lines().enumerate() {
            count = index + 1;
            let mut rest = whole;
            while !rest.is_empty() {
                let begins = offset(whole, rest);
                let open = comment.as_ref().is_some_and(|comment| !comment.is_ours);
                let mark = if comment.is_some() { "*/" } else { "/*" };
                let (piece, behind) = match rest.split_once(mark) {
                    Some((piece, behind)) => (piece, Some(behind)),
                    None => (rest, None),
                };
                if !open {
                    push(&mut lines, count, whole, piece);
                }
                let Some(behind) = behind else { break };
                rest = behind;
                comment = match comment {
                    Some(_) => None,
                    None => {
                        let content = behind.trim_start();
                        let is_ours = content.starts_with(OURS);
                        rest = content.strip_prefix(OURS).unwrap_or(behind);
                        Some(Comment {
                            line: count,
                            whole,
                            offset: begins + piece.len(),
                            is_ours,
                        })
                    }
                };
            }
        }
        match comment {
            Some(comment) => Err(MapError {
                line: comment.line,
                column: column(comment.whole, comment.offset),
                problem: "this comment does not end".to_owned(),
            }),
            None => Ok(Self {
                lines,
                next: 0,
                count,
            }),
        }
    }

    /// The next line, which stays the next.
    pub(super) fn peek(&self) -> Option<Line<'a>> {
        self.lines.get(self.next).copied()
    }

    /// The next line.
    ///
    /// # Errors
    /// There is none, and `wanted` is missing.
    pub(super) fn next(&mut self, wanted: &str) -> Result<Line<'a>, MapError> {
        let line = self.peek().ok_or_else(|| MapError {
            line: self.count.max(1),
            column: 1,
            problem: format!("the file ends, {wanted} is missing"),
        })?;
        self.next += 1;
        Ok(line)
    }

    /// The next line, if it has this key.
    pub(super) fn next_if(&mut self, key: &str) -> Option<Line<'a>> {
        let line = self.peek().filter(|line| line.key == key)?;
        self.next += 1;
        Some(line)
    }
}

struct Comment<'a> {
    line: usize,
    whole: &'a str,
    /// In bytes.
    offset: usize,
    is_ours: bool,
}

fn push<'a>(lines: &mut Vec<Line<'a>>, number: usize, whole: &'a str, piece: &'a str) {
    let item = piece.trim();
    if item.is_empty() {
        return;
    }
    let (key, rest) = item.split_once(char::is_whitespace).unwrap_or((item, ""));
    // A connector or an interval is its own key.
    let (key, rest) = match item.as_bytes().first() {
        Some(b'(') => ("(", item),
        Some(b'[') => ("[", item),
        _ => (key, rest.trim_start()),
    };
    lines.push(Line {
        number,
        whole,
        offset: offset(whole, item),
        key,
        rest,
        rest_offset: if rest.is_empty() {
            offset(whole, item) + item.len()
        } else {
            offset(whole, rest)
        },
    });
}

/// Where a part of a line begins, in bytes.
fn offset(whole: &str, part: &str) -> usize {
    part.as_ptr() as usize - whole.as_ptr() as usize
}

/// Counted from 1, in characters.
fn column(whole: &str, offset: usize) -> usize {
    1 + whole
        .get(..offset)
        .map_or(0, |before| before.chars().count())
}
