//! Version 3 of the file format: its sections, its contract, what is refused, and the files of older versions.

use std::collections::BTreeSet;
use std::fmt::Write as _;
use std::fs;
use std::path::Path;

use tpg_runtime::blob::{
    self, ActionKind, DecodeError, Missing, SIGNATURE_BYTES, SectionFault, Signature,
    contract_bytes,
};
use tpg_runtime::isa::Group;
use tpg_runtime::parts::{Field, Table};
use tpg_runtime::tables::Target;
use tpg_runtime::{Action, Blob, Header, Policy, VerifyError};
use tpg_tests::draft::{Draft, DraftProgram, DraftTeam, TestAgent, header};
use tpg_tests::random::{self, Dice};
use tpg_tests::{golden, mend, old_format, samples};

/// The bytes of `minimal.tpg` as `docs/format-3.md` prints them.
fn printed_minimal() -> Vec<u8> {
    let page = Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/format-3.md");
    let text = fs::read_to_string(page).expect("the page");
    let lines = text
        .lines()
        .skip_while(|line| !line.starts_with("000  54 50"));
    let rows = lines.take_while(|line| !line.starts_with("```"));
    let byte = |text: &str| u8::from_str_radix(text, 16).expect("a byte");
    rows.flat_map(|row| row.split_whitespace().skip(1).map(byte))
        .collect()
}

fn rewrite(file: &[u8]) -> Vec<u8> {
    let blob = Blob::decode(file).expect("a blob");
    let mut buffer = vec![0; blob::encoded_bound(blob.tables())];
    let len = blob::encode(blob.header(), blob.tables(), &mut buffer).expect("room");
    assert_eq!(len, buffer.len(), "the bound is the length");
    buffer
}

#[test]
fn the_smallest_file_is_as_printed() {
    let printed = printed_minimal();
    assert_eq!(printed.len(), 212);
    golden::assert_bytes("v3/minimal.tpg", &printed);
    let policy = Policy::load(&printed).expect("a policy");
    assert_eq!(policy.contract(), 0x321a_567a_fd21_b1eb);
    let mut agent = TestAgent::new(policy).expect("room");
    let decision = agent.decide(&[0.5]).expect("one element");
    assert_eq!(decision.action, Action::Discrete(1));
    assert_eq!(rewrite(&printed), printed, "one policy has one encoding");
}

/// Length of each section with its padding, and its place in the file.
fn sections(file: &[u8]) -> Vec<(u16, usize, usize)> {
    let count = usize::from(u16::from_le_bytes([file[86], file[87]]));
    let mut at = 96 + 8 * count;
    let entries = file[96..].chunks(8).take(count);
    let section = |entry: &[u8]| {
        let kind = u16::from_le_bytes([entry[0], entry[1]]);
        let len = u32::from_le_bytes([entry[4], entry[5], entry[6], entry[7]]) as usize;
        let start = at;
        at += len.next_multiple_of(4);
        (kind, start, len)
    };
    entries.map(section).collect()
}

#[test]
fn old_files_are_rewritten_without_changing_a_decision() {
    let champions = Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/champions");
    let mut old: Vec<(String, Vec<u8>)> = fs::read_dir(champions)
        .expect("a folder")
        .map(|entry| entry.expect("an entry").path())
        .filter(|path| path.extension().is_some_and(|extension| extension == "tpg"))
        .map(|path| (path.display().to_string(), fs::read(&path).expect("a file")))
        .collect();
    let names = samples::old_names().map(|name| (1, name));
    for (version, name) in names.chain(samples::perceiving().into_iter().map(|(name, _)| (2, name)))
    {
        let file = fs::read(golden::path(&format!("v{version}/{name}.tpg"))).expect("a file");
        let new = fs::read(golden::path(&format!("v3/{name}.tpg"))).expect("a file");
        assert_eq!(rewrite(&file), new, "{name}");
        assert_eq!(old_format(&new), file, "{name}");
        old.push((name.to_owned(), file));
    }
    let grown: BTreeSet<usize> = old
        .iter()
        .map(|(_, file)| rewrite(file).len() - file.len())
        .collect();
    println!("files grow by {grown:?} bytes");
    for (name, file) in old {
        let new = rewrite(&file);
        let [mut one, mut other] = [&file, &new].map(|bytes| {
            let policy = Policy::load(bytes).unwrap_or_else(|error| panic!("{name}: {error}"));
            Box::new(tpg_runtime::HostAgent::new(policy).expect("room"))
        });
        assert_eq!(one.policy().contract(), other.policy().header().contract);
        let mut dice = Dice::new(5);
        let inputs = usize::from(one.policy().header().observation_len);
        for step in 0..200 {
            // Of a complete observation and of one of which all is missing, both versions perceive the same.
            let observation: Vec<f32> = match step % 3 {
                0 => vec![f32::NAN; inputs],
                _ => (0..inputs).map(|_| dice.number()).collect(),
            };
            if observation.iter().all(|x| *x == 0.0) {
                continue;
            }
            let wanted = format!("{:?}", one.decide(&observation).expect("the right length"));
            let found = format!(
                "{:?}",
                other.decide(&observation).expect("the right length")
            );
            assert_eq!(found, wanted, "{name}");
        }
    }
}

#[test]
fn contracts_are_as_listed() {
    let listed = [
        ("acrobot", 106, 0xb101_e08b_15a5_9b71_u64),
        ("cartpole", 61, 0xae77_db59_894f_a96e),
        ("half-cheetah-b23", 790, 0xc039_c0eb_199b_05f1),
        ("hopper-b23", 428, 0xc39a_e439_c03d_8b34),
        ("inverted-double-pendulum-b23", 363, 0xc446_d72a_75b2_dbc1),
        ("pendulum", 65, 0x981c_b2ab_8a24_05d1),
    ];
    let mut text = String::from("# file, hash, bytes of the contract\n");
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/champions");
    let mut add = |name: &str, file: &[u8]| {
        let blob = Blob::decode(file).expect("a blob");
        let mut bytes = Vec::new();
        contract_bytes(blob.header(), blob.tables(), |part| {
            bytes.extend_from_slice(part);
        });
        let hex = bytes.iter().fold(String::new(), |mut hex, byte| {
            let _ = write!(hex, "{byte:02x}");
            hex
        });
        let _ = writeln!(text, "{name} {:016x} {hex}", blob.contract());
        (bytes.len(), blob.contract())
    };
    assert_eq!(
        add("minimal", &printed_minimal()),
        (26, 0x321a_567a_fd21_b1eb)
    );
    for (name, len, hash) in listed {
        let file = fs::read(folder.join(name).with_extension("tpg")).expect("a champion");
        assert_eq!(add(name, &file), (len, hash), "{name}");
    }
    golden::assert_text("v3/contract.txt", &text);
    let reworded = "x\tcm\n";
    let minimal = printed_minimal();
    let blob = Blob::decode(&minimal).expect("a blob");
    assert_ne!(
        blob::contract(blob.header(), reworded, &[]),
        blob.contract()
    );
    assert_eq!(
        blob::contract(blob.header(), "x\tm", &[]),
        blob.contract(),
        "a last line without line feed"
    );
}

/// What a file is refused with after a change, its checksum mended.
fn refusal(file: &[u8], change: impl FnOnce(&mut Vec<u8>)) -> VerifyError {
    let mut changed = file.to_vec();
    change(&mut changed);
    mend(&mut changed);
    Policy::load(&changed).map(|_| ()).expect_err("refused")
}

#[test]
fn directories_that_are_not_as_they_must_be_are_refused() {
    let file = printed_minimal();
    let section = |kind, fault| VerifyError::Decode(DecodeError::Section { kind, fault });
    let entry = |k: usize| 96 + 8 * k;
    let refused = |change: &dyn Fn(&mut Vec<u8>)| refusal(&file, |bytes| change(bytes));
    assert_eq!(
        refused(&|b| b[entry(1)] = 1),
        section(1, SectionFault::Order)
    );
    assert_eq!(
        refused(&|b| b[entry(0)] = 0),
        section(0, SectionFault::Order)
    );
    assert_eq!(
        refused(&|b| b[entry(1)] = 11),
        section(3, SectionFault::Order)
    );
    assert_eq!(
        refused(&|b| b[entry(0) + 2] = 1),
        section(1, SectionFault::Reserved)
    );
    assert_eq!(
        refused(&|b| b[entry(5) + 4] = 0),
        section(11, SectionFault::Empty)
    );
    assert_eq!(
        refused(&|b| b[entry(5) + 4] = 5),
        section(11, SectionFault::Beyond)
    );
    assert_eq!(
        refused(&|b| b[entry(5) + 7] = 0xff),
        section(11, SectionFault::Beyond)
    );
    assert_eq!(
        refused(&|b| b[entry(5)] = 14),
        section(14, SectionFault::Critical)
    );
    assert_eq!(
        refused(&|b| b[entry(5)] = 13),
        section(13, SectionFault::Critical)
    );
    let padding = sections(&file)[1].1 + 2;
    assert_eq!(
        refused(&|b| b[padding] = 1),
        section(2, SectionFault::Padding)
    );
    let last = file.len() - 5;
    assert_eq!(
        refused(&|b| b[last] = 0xff),
        section(11, SectionFault::Text)
    );
    // A section that is shorter than the body says leaves bytes over.
    let shorter = refused(&|b| {
        b.splice(last + 1..last + 1, [0; 4]);
        b[12] += 4;
    });
    assert_eq!(shorter, VerifyError::Decode(DecodeError::Body));
    let width = refused(&|b| b[entry(0) + 4] = 23);
    assert_eq!(
        width,
        VerifyError::Decode(DecodeError::RecordWidth {
            table: Table::Teams
        })
    );
    let field = |field| VerifyError::Decode(DecodeError::HeaderField { field });
    for (at, value, name) in [
        (6, 72, Field::HeaderLength),
        (15, 1, Field::BodyBytes),
        (54, 1, Field::FrontEndWords),
        (84, 0, Field::History),
        (86, 33, Field::Sections),
        (88, 4, Field::Missing),
        (89, 1, Field::Tasks),
        (90, 1, Field::Reserved),
        (95, 1, Field::Reserved),
    ] {
        assert_eq!(refused(&|b| b[at] = value), field(name));
    }
    // A window of one word holds no two observations.
    let window = VerifyError::Header {
        field: Field::Window,
        needed: 2,
        got: 1,
    };
    assert_eq!(refused(&|b| b[84] = 2), window);
    assert_eq!(refused(&|b| b[88] = 2), VerifyError::FrontEndMalformed);
    assert!(matches!(
        refused(&|b| b[72] ^= 1),
        VerifyError::Contract { .. }
    ));
    assert!(matches!(
        refused(&|b| b[48] ^= 1),
        VerifyError::Contract { .. }
    ));
    let unit = sections(&file)[3].1 + 2;
    assert!(matches!(
        refused(&|b| b[unit] = b'M'),
        VerifyError::Contract { .. }
    ));
    assert_eq!(refused(&|b| b[unit] = 7), VerifyError::Labels);
    assert_eq!(refused(&|b| b[unit + 1] = b'm'), VerifyError::Labels);
    assert_eq!(refused(&|b| b[43] = 0x80), VerifyError::ActionRange);
    for len in 72..96 {
        let Err(DecodeError::Truncated { needed: 96, got }) = Blob::decode(&file[..len]) else {
            panic!("{len} bytes are no header");
        };
        assert_eq!(got, len);
    }
}

/// Adds a section at the end of a file.
fn with_section(file: &[u8], kind: u16, contents: &[u8]) -> Vec<u8> {
    let mut file = file[..file.len() - 4].to_vec();
    let count = usize::from(file[86]);
    let at = 96 + 8 * count;
    file[86] += 1;
    let mut entry = kind.to_le_bytes().to_vec();
    entry.extend([0; 2]);
    entry.extend((contents.len() as u32).to_le_bytes());
    file.splice(at..at, entry);
    file.extend(contents);
    file.resize(file.len().next_multiple_of(4), 0);
    let body = (file.len() - 96) as u32;
    file[12..16].copy_from_slice(&body.to_le_bytes());
    file.extend([0; 4]);
    mend(&mut file);
    file
}

#[test]
fn sections_that_may_be_skipped_are_skipped() {
    let minimal = printed_minimal();
    let skipped = with_section(&minimal, 49_152, b"notes");
    golden::assert_bytes("v3/skipped.tpg", &skipped);
    let mut agent = TestAgent::new(Policy::load(&skipped).expect("a policy")).expect("room");
    let decision = agent.decide(&[0.0]).expect("one element");
    assert_eq!(decision.action, Action::Discrete(1));
    assert_eq!(
        rewrite(&skipped),
        minimal,
        "what is not known is not written"
    );
}

#[test]
fn a_signature_is_handed_out_with_what_it_signs() {
    let minimal = printed_minimal();
    assert!(
        Blob::decode(&minimal)
            .expect("a blob")
            .signature()
            .is_none()
    );
    let bytes: [u8; SIGNATURE_BYTES] = std::array::from_fn(|k| k as u8);
    let section = Signature::section(*b"\x01\x02\x03\x04\x05\x06\x07\x08", &bytes);
    let signed = with_section(&minimal, 65_535, &section);
    assert_eq!(signed.len(), 300);
    let blob = Blob::decode(&signed).expect("a blob");
    let signature = blob.signature().expect("a signature");
    assert_eq!(signature.key, [1, 2, 3, 4, 5, 6, 7, 8]);
    assert_eq!(*signature.bytes, bytes);
    assert_eq!(signature.signed, &signed[..232]);
    let mut buffer = vec![0; 300];
    let len = blob::encode_signed(blob.header(), blob.tables(), &section, &mut buffer);
    assert_eq!((len, buffer), (Ok(300), signed.clone()));
    assert!(Policy::load(&signed).is_ok());
    let form = VerifyError::Decode(DecodeError::Section {
        kind: 65_535,
        fault: SectionFault::Form,
    });
    for at in 0..8 {
        assert_eq!(
            refusal(&signed, |b| b[216 + at] ^= 2),
            form,
            "byte {at} of the section"
        );
    }
    let short = with_section(&minimal, 65_535, &section[..79]);
    assert_eq!(Policy::load(&short).map(|_| ()), Err(form));
}

/// A discrete policy of one team with these members.
fn team_of(programs: u16, members: Vec<u16>) -> Draft {
    let mut draft = Draft {
        header: header(1, 1),
        teams: vec![DraftTeam {
            members,
            ..DraftTeam::default()
        }],
        programs: Vec::new(),
        cells: Vec::new(),
        image: Vec::new(),
        front_end: Vec::new(),
        ranges: Vec::new(),
    };
    draft.header.action_kind = ActionKind::Discrete;
    draft.header.groups = Group::Scalar.bit();
    for _ in 0..programs {
        draft
            .programs
            .push(DraftProgram::bidding(0.0, Target::Atomic(0)));
    }
    draft
}

#[test]
fn no_team_lists_a_program_twice() {
    const PROGRAMS: u16 = 300;
    for (first, second) in [(0, 1), (0, 299), (150, 151), (7, 128), (298, 299)] {
        for program in [0, 7, 8, 127, 128, 255, 299] {
            let mut members: Vec<u16> = (0..PROGRAMS).collect();
            members[first] = program;
            members[second] = program;
            members.sort_by_key(|k| *k % 17);
            let draft = team_of(PROGRAMS, members);
            let refused = Policy::load(&draft.encode()).map(|_| ());
            assert!(
                matches!(refused, Err(VerifyError::DuplicateMember { team: 0, .. })),
                "{refused:?}"
            );
            // Older versions allow it.
            assert!(Policy::load(&old_format(&draft.encode())).is_ok());
        }
    }
    let mut draft = team_of(3, vec![0, 1]);
    draft.teams.push(DraftTeam {
        members: vec![1, 2, 1],
        ..DraftTeam::default()
    });
    let refused = Policy::load(&draft.encode()).map(|_| ());
    assert_eq!(
        refused,
        Err(VerifyError::DuplicateMember {
            team: 1,
            program: 1
        })
    );
}

#[test]
fn limits_are_those_of_the_version() {
    let file = |programs: u16| team_of(programs, (0..programs).collect()).encode();
    assert!(Policy::load(&file(2048)).is_ok());
    let beyond = file(2049);
    let limit = VerifyError::Header {
        field: Field::Programs,
        needed: 2048,
        got: 2049,
    };
    assert_eq!(Policy::load(&beyond).map(|_| ()), Err(limit));
    assert!(Policy::load(&old_format(&beyond)).is_ok());
}

#[test]
fn outputs_fill_vectors_of_their_program_and_no_more() {
    let load = |draft: &Draft| Policy::load(&draft.encode()).map(|_| ());
    for (name, draft) in samples::large() {
        assert_eq!(load(&draft), Ok(()), "{name}");
    }
    let sample = |name| {
        let found = samples::large().into_iter().find(|(n, _)| *n == name);
        found.expect("a sample").1
    };
    // One more output would lie behind the last vector.
    assert_eq!(load(&samples::outputs(3 * 32, [2, 4, 0], 1)), Ok(()));
    let beyond = samples::outputs(3 * 32 + 1, [2, 4, 0], 1);
    let refused = VerifyError::NoSuchTarget { program: 0 };
    assert_eq!(load(&beyond), Err(refused));
    let many = samples::outputs(257, [2, 9, 0], 0);
    let most = VerifyError::Header {
        field: Field::Actions,
        needed: 256,
        got: 257,
    };
    assert_eq!(load(&many), Err(most));
    let mut silent = sample("each-78");
    silent.teams[0].members.retain(|member| member % 78 != 70);
    assert_eq!(load(&silent), Err(VerifyError::NoProgramFor { output: 70 }));
    // Older versions have as many outputs as a vector has elements.
    let refused = Policy::load(&old_format(&sample("each-78").encode())).map(|_| ());
    let most = VerifyError::Header {
        field: Field::Actions,
        needed: 32,
        got: 78,
    };
    assert_eq!(refused, Err(most));
}

#[test]
fn outputs_are_the_winners_words_in_order() {
    for (name, draft) in samples::large() {
        let bytes = draft.encode();
        let policy = Policy::load(&bytes).unwrap_or_else(|error| panic!("{name}: {error}"));
        let mut agent = TestAgent::new(policy).expect("enough room");
        let observation = vec![0.25; usize::from(policy.header().observation_len)];
        let decision = agent.decide(&observation).expect("right length");
        let Action::Continuous(outputs) = decision.action else {
            panic!("{name}: {:?}", decision.action);
        };
        assert_eq!(outputs.len(), policy.header().outputs(), "{name}");
        if name == "each-78" {
            // Of the programs k and k + 78 of output k, those whose number 5 divides bid 1, the others 0.
            let winner = |k: usize| {
                if (k + 78).is_multiple_of(5) {
                    k + 78
                } else {
                    k
                }
            };
            let wanted: Vec<f32> = (0..78).map(|k| winner(k) as f32 / 256.0 + 0.25).collect();
            assert_eq!(outputs, wanted, "{name}");
        }
    }
}

#[test]
fn the_header_alone_says_what_is_missing_and_what_is_agreed() {
    for (name, draft) in samples::perceiving() {
        let file = draft.encode();
        let header = Header::peek(&file[..Header::BYTES]).expect("a header");
        let expected = match name {
            "standardised" => Missing::Mean,
            "held" => Missing::Hold,
            _ => Missing::Model,
        };
        assert_eq!((header.version, header.missing), (3, expected), "{name}");
        assert_eq!(
            header.contract,
            Policy::load(&file).expect("a policy").contract()
        );
        let old = old_format(&file);
        let header = Header::peek(&old[..Header::BYTES]).expect("a header");
        assert_eq!((header.version, header.contract), (2, 0), "{name}");
    }
    for seed in 0..50 {
        let file = random::policy(seed).encode();
        let header = Header::peek(&file).expect("a header");
        assert_eq!(
            (header.missing, header.history, header.release),
            (Missing::Zero, 1, 0)
        );
    }
}
