#pragma once
#include "../formats/memory.h"
#include "arkit.h"

namespace avatar {

/// A recording of a face: frames at rising times.
struct Recording {
    Span<double> times;     // [F] seconds from the first frame, rising
    Span<double> channels;  // [F, 61], in the order of arkit_names; what the file lacks is 0
    uint32_t without_face;  // records that are left out
    double fps;             // from the median step

    double seconds() const { return times[times.size - 1]; }

    /// Writes the frame at a time, linear between two frames; beyond the ends, the frame at the end. Allocates nothing.
    void sample(double at_seconds, AvatarFrame& frame) const;
};

/// Takes 61 channels.
void set_channels(AvatarFrame& frame, const double* channels);

/// The recording in the text of a Live Link Face CSV: a timecode, a count and up to 61 named columns a row. Columns are
/// matched by name in any order and case; unknown columns are ignored. The timecode is HH:MM:SS:FF.sss, where FF.sss
/// counts frames of a rate that the file does not store: the smallest common rate above the highest FF. A row whose
/// BlendShapeCount is 0 has no face: it is left out and counted. Sets the arena's error, which names line and column.
void read_live_link_csv(Text text, Recording& into, Arena& arena);

/// Frames a second of times, from the median step.
double rate_of(Span<double> times, Arena& scratch);

/// Takes the face of a packet of Live Link Face, version 6, all numbers big-endian: u8 version; device id and subject
/// name, each a u32 length and UTF-8 text; frame number i32, sub-frame f32, frame rate as numerator i32 and denominator
/// i32; then, if a face was seen, u8 count (61) and 61 f32 in the order of arkit_names. Returns false, and leaves the
/// frame as it is, for a packet without a face and for one that is not understood to its last byte.
bool read_packet(const uint8_t* packet, size_t length, AvatarFrame& into);

/// A record of a CSV file: its fields, and the line on which it begins, from 1. An empty line has no fields.
struct CsvRow {
    uint32_t line;
    Span<Text> fields;
};

/// Reads CSV texts, with quotes as RFC 4180 has them.
class Csv {
public:
    Csv(Text text, Arena& arena);

    /// The next record; false at the end, and where the error is set. Its fields live until the next one.
    bool next(CsvRow* row);

private:
    int letter(size_t at) const { return at < text_.size ? static_cast<unsigned char>(text_.data[at]) : -1; }
    bool plain();
    bool quoted();

    Text text_;
    Arena& arena_;
    Grown<Text> fields_;
    size_t at_ = 0;
    uint32_t line_ = 1;
};

}  // namespace avatar
