//! Videos: pictures encoded as H.264 (constrained baseline, which all players support) in an MP4 file.
//!
//! Colours are ITU-R BT.601, limited range, one colour per two by two pixels.

use std::num::NonZeroU32;

use rusty_h264_common::YuvFrame;
use rusty_h264_encoder::{EncodeError, EncoderConfig, Preset};
use shiguredo_mp4::boxes::{Avc1Box, AvccBox, SampleEntry, UnknownBox, VisualSampleEntryFields};
use shiguredo_mp4::mux::estimate_maximum_moov_box_size;
use shiguredo_mp4::mux::{Mp4FileMuxer, Mp4FileMuxerOptions, MuxError, Sample};
use shiguredo_mp4::{BoxSize, BoxType, TrackKind, Uint};

use super::Picture;

/// Quantisation: near 20 no loss is visible.
const QUALITY: u8 = 20;

/// Types of the units in an H.264 stream.
const SEQUENCE_PARAMETERS: u8 = 7;
const PICTURE_PARAMETERS: u8 = 8;
const KEY_PICTURE: u8 = 5;

/// Why a video could not be made.
#[derive(Debug, thiserror::Error)]
pub enum VideoError {
    /// H.264 has one colour per two by two pixels.
    #[error("a video's width and height must be even, not {0} x {1}")]
    Odd(usize, usize),
    /// The encoder failed.
    #[error("cannot encode: {0}")]
    Encode(#[from] EncodeError),
    /// The MP4 file could not be written.
    #[error("cannot write MP4: {0}")]
    Mux(#[from] MuxError),
}

/// Encodes a video, picture by picture.
pub struct Encoder {
    coder: rusty_h264_encoder::Encoder,
    /// Pictures per second.
    rate: NonZeroU32,
    size: [usize; 2],
    /// Units that describe the stream, without their start codes.
    parameters: [Option<Vec<u8>>; 2],
    /// Coded pictures: whether it stands for itself, and its length in `data`.
    pictures: Vec<(bool, usize)>,
    data: Vec<u8>,
}

impl Encoder {
    /// For pictures of a size in pixels, so many per second.
    ///
    /// # Errors
    /// When the size is not one of a video.
    pub fn new(size: [usize; 2], rate: NonZeroU32) -> Result<Self, VideoError> {
        let [width, height] = size;
        if width % 2 == 1 || height % 2 == 1 {
            return Err(VideoError::Odd(width, height));
        }
        let mut config = EncoderConfig::baseline(width, height);
        config.preset = Preset::Fast;
        config.qp = QUALITY;
        // A picture that stands for itself each two seconds: players seek to these.
        config.gop_size = 2 * rate.get();
        config.min_keyint = config.gop_size;
        config.framerate = rate.get() as f32;
        config.level_idc = level(width.div_ceil(16) * height.div_ceil(16), rate.get());
        Ok(Self {
            coder: rusty_h264_encoder::Encoder::new(config)?,
            rate,
            size,
            parameters: [None, None],
            pictures: Vec::new(),
            data: Vec::new(),
        })
    }

    /// Appends a picture of the size announced.
    ///
    /// # Errors
    /// Of the encoder.
    pub fn push(&mut self, picture: &Picture) -> Result<(), VideoError> {
        let stream = self.coder.try_encode(&planes(picture))?;
        let (mut is_key, before) = (false, self.data.len());
        for unit in units(&stream) {
            match unit.first().map_or(0, |head| head & 0x1f) {
                SEQUENCE_PARAMETERS => self.parameters[0] = Some(unit.to_vec()),
                PICTURE_PARAMETERS => self.parameters[1] = Some(unit.to_vec()),
                kind => {
                    is_key |= kind == KEY_PICTURE;
                    // In a file, lengths stand where a stream has start codes.
                    self.data.extend((unit.len() as u32).to_be_bytes());
                    self.data.extend(unit);
                }
            }
        }
        self.pictures.push((is_key, self.data.len() - before));
        Ok(())
    }

    /// The file.
    ///
    /// # Errors
    /// Of the file format.
    pub fn finish(self) -> Result<Vec<u8>, VideoError> {
        let options = Mp4FileMuxerOptions {
            reserved_moov_box_size: estimate_maximum_moov_box_size(&[self.pictures.len()]),
            ..Mp4FileMuxerOptions::default()
        };
        let mut muxer = Mp4FileMuxer::with_options(options)?;
        let mut file = muxer.initial_boxes_bytes().to_vec();
        let mut offset = file.len() as u64;
        file.extend(&self.data);
        let mut entry = Some(self.description());
        for &(keyframe, data_size) in &self.pictures {
            muxer.append_sample(&Sample {
                track_kind: TrackKind::Video,
                sample_entry: entry.take(),
                keyframe,
                timescale: self.rate,
                duration: 1,
                composition_time_offset: None,
                data_offset: offset,
                data_size,
            })?;
            offset += data_size as u64;
        }
        for (offset, bytes) in muxer.finalize()?.offset_and_bytes_pairs() {
            let start = offset as usize;
            file.resize(file.len().max(start + bytes.len()), 0);
            file[start..start + bytes.len()].copy_from_slice(bytes);
        }
        Ok(file)
    }

    /// What a player must know before the first picture.
    fn description(&self) -> SampleEntry {
        let [sequence, picture] = self.parameters.clone().map(Option::unwrap_or_default);
        let head = |index: usize| sequence.get(index).copied().unwrap_or_default();
        let [width, height] = self.size.map(|pixels| pixels as u16);
        SampleEntry::Avc1(Avc1Box {
            visual: VisualSampleEntryFields {
                data_reference_index: VisualSampleEntryFields::DEFAULT_DATA_REFERENCE_INDEX,
                width,
                height,
                horizresolution: VisualSampleEntryFields::DEFAULT_HORIZRESOLUTION,
                vertresolution: VisualSampleEntryFields::DEFAULT_VERTRESOLUTION,
                frame_count: VisualSampleEntryFields::DEFAULT_FRAME_COUNT,
                compressorname: VisualSampleEntryFields::NULL_COMPRESSORNAME,
                depth: VisualSampleEntryFields::DEFAULT_DEPTH,
            },
            avcc_box: AvccBox {
                avc_profile_indication: head(1),
                profile_compatibility: head(2),
                avc_level_indication: head(3),
                length_size_minus_one: Uint::new(3),
                sps_list: vec![sequence],
                pps_list: vec![picture],
                chroma_format: None,
                bit_depth_luma_minus8: None,
                bit_depth_chroma_minus8: None,
                sps_ext_list: Vec::new(),
            },
            unknown_boxes: vec![colors()],
        })
    }
}

/// The box that says BT.601 (525 lines), limited range: code points 6 of ISO/IEC 23091-2.
fn colors() -> UnknownBox {
    let payload = [&b"nclx"[..], &[0, 6, 0, 6, 0, 6, 0]].concat();
    UnknownBox {
        box_type: BoxType::Normal(*b"colr"),
        box_size: BoxSize::U32(8 + payload.len() as u32),
        payload,
    }
}

/// The least level of H.264's table A-1, from 3.1 on, that allows a picture of so many macroblocks
/// (16 x 16 pixels), so often a second.
fn level(macroblocks: usize, rate: u32) -> u8 {
    let levels = [(31, 3_600, 108_000), (40, 8_192, 245_760), (51, 36_864, 983_040)];
    let each_second = macroblocks * rate as usize;
    let enough = |(_, most, per_second): &(u8, usize, usize)| {
        macroblocks <= *most && each_second <= *per_second
    };
    levels.into_iter().find(enough).map_or(52, |(level, ..)| level)
}

/// The units of a stream, between start codes (two or three zeros and a one).
fn units(stream: &[u8]) -> impl Iterator<Item = &[u8]> {
    let mut starts: Vec<usize> = stream
        .windows(3)
        .enumerate()
        .filter(|(_, code)| *code == [0, 0, 1])
        .map(|(at, _)| at)
        .collect();
    starts.push(stream.len());
    let pairs: Vec<_> = starts.windows(2).map(|pair| [pair[0] + 3, pair[1]]).collect();
    pairs.into_iter().map(|[start, end]| {
        // A unit never ends in a zero: those belong to the next start code.
        let zeros = stream[start..end].iter().rev().take_while(|byte| **byte == 0).count();
        &stream[start..end - zeros]
    })
}

/// The nearest number of a byte.
fn byte(value: f32) -> u8 {
    // Without SSE4.1, `round` is a call.
    (value + 0.5) as u8
}

/// Luma and the two colour differences (BT.601, limited range) of a picture of even size.
fn planes(picture: &Picture) -> YuvFrame {
    let Picture { width, height, ref rgb } = *picture;
    let at = |x: usize, y: usize| {
        let start = 3 * (y * width + x);
        [0, 1, 2].map(|part| f32::from(rgb[start + part]))
    };
    let luma = |[r, g, b]: [f32; 3]| 0.299 * r + 0.587 * g + 0.114 * b;
    let mut frame = YuvFrame {
        width,
        height,
        y: Vec::with_capacity(width * height),
        u: Vec::with_capacity(width * height / 4),
        v: Vec::with_capacity(width * height / 4),
    };
    let pixels = rgb.as_chunks().0;
    frame.y.extend(
        pixels.iter().map(|rgb: &[u8; 3]| byte(16.0 + 219.0 / 255.0 * luma(rgb.map(f32::from)))),
    );
    for y in (0..height).step_by(2) {
        for x in (0..width).step_by(2) {
            let four = [at(x, y), at(x + 1, y), at(x, y + 1), at(x + 1, y + 1)];
            let mean =
                [0, 1, 2].map(|part| four.iter().map(|color| color[part]).sum::<f32>() / 4.0);
            let luma = luma(mean);
            let difference = |part: f32, weight: f32| {
                byte(128.0 + 224.0 / 255.0 / 2.0 / (1.0 - weight) * (part - luma))
            };
            frame.u.push(difference(mean[2], 0.114));
            frame.v.push(difference(mean[0], 0.299));
        }
    }
    frame
}
