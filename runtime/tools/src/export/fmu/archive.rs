//! ZIP archives of files that are stored as they are.

use crc::{CRC_32_ISO_HDLC, Crc, NoTable};

/// Makes an archive. All files have the format's earliest date, 1 January 1980.
pub(super) fn zip(files: &[(String, Vec<u8>)]) -> Vec<u8> {
    let (mut out, mut directory) = (Vec::new(), Vec::new());
    for (path, content) in files {
        let place = size(out.len());
        let entry = entry(path, content);
        out.extend(b"PK\x03\x04");
        out.extend(&entry);
        out.extend(path.as_bytes());
        out.extend(content);
        // Made by version 2.0 for a file system without owners.
        directory.extend(b"PK\x01\x02\x14\x00");
        directory.extend(&entry);
        // No comment, first disk, no attributes.
        directory.extend([0; 10]);
        directory.extend(place);
        directory.extend(path.as_bytes());
    }
    let (start, length) = (size(out.len()), size(directory.len()));
    let count = (files.len() as u16).to_le_bytes();
    out.extend(directory);
    out.extend(b"PK\x05\x06\x00\x00\x00\x00");
    out.extend([count, count].concat());
    out.extend([length, start].concat());
    out.extend([0; 2]);
    out
}

/// What both headers of a file say: version, flags, method, time, date, checksum, sizes, lengths.
fn entry(path: &str, content: &[u8]) -> Vec<u8> {
    let checksum = Crc::<u32, NoTable>::new(&CRC_32_ISO_HDLC).checksum(content);
    let length = size(content.len());
    let mut entry = vec![0x14, 0, 0, 0, 0, 0, 0, 0, 0x21, 0];
    entry.extend(checksum.to_le_bytes());
    entry.extend([length, length].concat());
    entry.extend((path.len() as u16).to_le_bytes());
    entry.extend([0; 2]);
    entry
}

/// A size or place. Units are far below the format's limit of 4 GiB.
fn size(bytes: usize) -> [u8; 4] {
    (bytes as u32).to_le_bytes()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_archive_has_its_directory_at_the_end() {
        let file = ("a/b.txt".to_owned(), b"123456789".to_vec());
        let archive = zip(&[file]);
        // The published check value of CRC-32.
        assert_eq!(archive[14..18], 0xcbf4_3926u32.to_le_bytes());
        let (name, content) = archive[30..].split_at(7);
        assert_eq!((name, &content[..9]), (&b"a/b.txt"[..], &b"123456789"[..]));
        let end = &archive[archive.len() - 22..];
        assert_eq!(&end[..4], b"PK\x05\x06");
        assert_eq!((end[8], end[10], end[16]), (1, 1, 30 + 7 + 9));
        assert_eq!(&archive[46..50], b"PK\x01\x02");
        assert_eq!(usize::from(end[12]), 46 + 7);
    }
}
