//! Which requests are carried out, and the answer that is sent again.

use super::{Answer, Frame, Request, write};

/// A request whose number is further above the last one begins a conversation. So a wrong number can make a controller deaf to
/// at most as many requests after it.
const AHEAD: u32 = 1024;
/// The most numbers below the last one that are late. Half of all numbers are above.
const LATE: u32 = 1 << 31;

/// The last request that a controller carried out, and its answer in at most `N` bytes.
#[derive(Debug, Clone)]
pub struct Answers<const N: usize> {
    /// The numbers of the conversation's first request and of the last one.
    conversation: Option<(u32, u32)>,
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
            conversation: None,
            frame: [0; N],
            len: 0,
        }
    }

    /// Whether a request is a new one, to be carried out. A greeting always is.
    #[must_use]
    pub fn is_new(&self, request: &Frame<Request<'_>>) -> bool {
        match (request.message, self.conversation) {
            (Request::Hello, _) | (_, None) => true,
            (_, Some((first, last))) => {
                last.wrapping_sub(request.seq) > last.wrapping_sub(first).min(LATE)
            }
        }
    }

    /// The bytes to send for a request that is not new. Its host repeats the last one if the answer was lost, so it gets that
    /// answer again. An older one is a duplicate and gets nothing.
    #[must_use]
    pub fn again(&self, seq: u32) -> &[u8] {
        if self.conversation.is_some_and(|(_, last)| last == seq) {
            self.sent()
        } else {
            &[]
        }
    }

    /// Keeps the answer to a request that was carried out, and returns the bytes to send. An answer that is too long is
    /// dropped, as if the line had lost it.
    pub fn keep(&mut self, answer: &Frame<Answer<'_>>) -> &[u8] {
        let first = match self.conversation {
            Some((first, last)) if answer.seq.wrapping_sub(last) <= AHEAD => first,
            _ => answer.seq,
        };
        self.conversation = Some((first, answer.seq));
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
        assert!(answers.is_new(&commit(6)), "nothing of this conversation");
        answers.keep(&Frame { seq: 1000, message });
        for late in [7, 8, 999] {
            assert!(!answers.is_new(&commit(late)) && answers.again(late).is_empty());
        }
        for new in [6, 1001, 5_000_000] {
            assert!(answers.is_new(&commit(new)), "{new}");
        }
        assert!(answers.is_new(&request(7, Request::Hello)));
    }

    #[test]
    fn no_far_number_makes_a_controller_deaf() {
        let mut answers = Answers::<64>::new();
        let (mut honest, message) = (u32::MAX - 5, Answer::Ready);
        for wild in [AHEAD + 1, AHEAD + 9, 1 << 31, u32::MAX - 5] {
            for _ in 0..3 {
                honest = honest.wrapping_add(1);
                let next = request(honest, Request::Commit);
                assert!(answers.is_new(&next), "{honest} after {wild}");
                answers.keep(&Frame {
                    seq: honest,
                    message,
                });
            }
            let wild = honest.wrapping_add(wild);
            if answers.is_new(&request(wild, Request::Commit)) {
                answers.keep(&Frame { seq: wild, message });
            }
        }
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
