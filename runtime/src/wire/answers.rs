//! Which requests are carried out, and the answer that is sent again.

use super::{Answer, Frame, Request, write};

/// How many numbers below the last one are those of late duplicates.
///
/// A line keeps the order of frames, so few are enough. Any other number is a new request, so that no number of a frame
/// can make a controller deaf to the requests after it.
const LATE: u32 = 16;

/// The last request that a controller carried out, and its answer in at most `N` bytes.
#[derive(Debug, Clone)]
pub struct Answers<const N: usize> {
    last: Option<u32>,
    frame: [u8; N],
    len: usize,
}

impl<const N: usize> Default for Answers<N> {
    fn default() -> Self {
        Self::new()
    }
}

impl<const N: usize> Answers<N> {
    /// No answer yet.
    #[must_use]
    pub const fn new() -> Self {
        Answers {
            last: None,
            frame: [0; N],
            len: 0,
        }
    }

    /// Whether a request is a new one, to be carried out. A greeting always is.
    #[must_use]
    pub fn is_new(&self, request: &Frame<Request<'_>>) -> bool {
        match (request.message, self.last) {
            (Request::Hello, _) | (_, None) => true,
            (_, Some(last)) => last.wrapping_sub(request.seq) > LATE,
        }
    }

    /// The bytes to send for a request that is not new. Its host repeats the last one if the answer was lost, so it gets that
    /// answer again. An older one is a duplicate and gets nothing.
    #[must_use]
    pub fn again(&self, seq: u32) -> &[u8] {
        if self.last == Some(seq) {
            self.sent()
        } else {
            &[]
        }
    }

    /// Keeps the answer to a request that was carried out, and returns the bytes to send. An answer that is too long is
    /// dropped, as if the line had lost it.
    pub fn keep(&mut self, answer: &Frame<Answer<'_>>) -> &[u8] {
        self.last = Some(answer.seq);
        self.len = write(answer, &mut self.frame).unwrap_or(0);
        self.sent()
    }

    fn sent(&self) -> &[u8] {
        self.frame.get(..self.len).unwrap_or_default()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn request(seq: u32, message: Request<'static>) -> Frame<Request<'static>> {
        Frame { seq, message }
    }

    #[test]
    fn repeated_and_late_requests_are_not_carried_out_again() {
        let mut answers = Answers::<64>::new();
        let commit = |seq| request(seq, Request::Commit);
        assert!(answers.is_new(&commit(7)));
        let message = Answer::Ready;
        let sent = answers.keep(&Frame { seq: 7, message }).to_vec();
        assert!(!sent.is_empty());
        assert!(!answers.is_new(&commit(7)) && answers.again(7) == sent);
        for late in [6, 7_u32.wrapping_sub(LATE)] {
            assert!(!answers.is_new(&commit(late)) && answers.again(late).is_empty());
        }
        for new in [8, 1000, 7_u32.wrapping_sub(LATE + 1)] {
            assert!(answers.is_new(&commit(new)), "{new}");
        }
        assert!(answers.is_new(&request(7, Request::Hello)));
    }

    #[test]
    fn an_answer_that_is_too_long_is_dropped() {
        let mut answers = Answers::<16>::new();
        let message = Answer::Values {
            values: &[1; 32],
            instructions: 1,
        };
        assert!(answers.keep(&Frame { seq: 1, message }).is_empty());
    }
}
