#pragma once
#include <cmath>

#include "../formats/gzip.h"
#include "../formats/json.h"
#include "model.h"

namespace avatar {

/// Where a tensor lies: bytes begin .. end of the body.
struct TensorEntry {
    double begin, end;
};

/// The header of a pack: its document, and its tensors by name.
struct Header {
    Header(Arena& arena) : tree(arena, "header"), document(arena, "$") {}

    JsonTree tree;
    JsonTree document;
    Names names;
    Span<TensorEntry> tensors;

    /// Reads the JSON of a safetensors body whose tensors are bytes. False where the error is set.
    bool read(Text text, Arena& scratch);
};

/// A pack that is read: what lies in `scratch` is given back when the avatar is made, what lies in `arena` stays.
struct Reading {
    Arena& arena;
    Arena& scratch;
    Errors& errors;
    const Header& header;
    const uint8_t* body;  // byte 0 of the tensors
    double file_bytes;

    bool failed() const { return errors.any(); }
};

/// An array that no buffer holds.
struct HeldArray {
    Text name;
    Text type;  // "f32", "u8", "u16", "u32", "i32"
    uint32_t rank;
    double shape[4];
    Elements elements;

    /// Whether it has this type and shape; -1 is any length.
    bool is(Text wanted, const double* lengths, uint32_t count) const;
};

/// The arrays of a document.
struct HeldArrays {
    Names names;
    Span<HeldArray> arrays;

    /// Null: there is none.
    const HeldArray* find(Text name) const;
};

/// Sections and arrays from the tensors of a document.
class Tensors {
public:
    explicit Tensors(const Reading& reading);

    /// The buffers of a program, and their names.
    void read_buffers(Json listed, Program& program);
    HeldArrays arrays(Json listed);

private:
    Span<Section> sections(Text buffer, JsonList listed);
    Elements decode(Json tensor, Text codec, uint32_t bits, double count, uint32_t record, Text where, Arena& into);
    bool take(double count, uint32_t bits, Text where);
    bool around_vertices(double vertices, const Section* corners, Text where, Span<uint32_t>* ptr, Span<uint32_t>* triangles,
                         Arena& into) const;

    const Reading& reading_;
    double most_, left_;  // bytes that sections and arrays decode to
};

/// `count` elements of a tensor, in `into`; `where` names the section in errors.
Elements decode_elements(const Reading& reading, TensorEntry at, Text codec, uint32_t bits, double count, uint32_t record,
                         Text where, Arena& into);

/// Numbers narrowed to `bits`, each modulo 2^bits, in own memory.
Elements narrowed(Arena& arena, Span<uint32_t> numbers, uint32_t bits);

/// The field of an error about a section or a buffer.
struct Place {
    char data[300];

    Place(Text buffer, Text section = Text());
    Place(Text array_name, int);
    operator Text() const { return Text(data); }
};

/// Sets the error for a document of a newer version, or of kernels of one.
void check_version(Json document, Errors& errors);
void check_shaders(Json document, Errors& errors);
/// Whether a text is MAJOR.MINOR.
bool is_version(Text text);

/// Sets the error for a document that is not as SPEC.md has it: types, ranges, lengths, names that must be there, known values.
void check_form(Json document, Arena& scratch);

/// Reads the program of a document, but for its buffers.
void read_program(Json said, Program& program, Arena& arena);

/// Checks a whole program before anything is uploaded: no pass that is accepted leaves its buffers. The error's field
/// says which pass and which constant, section or buffer. Bound::index is set.
void check_program(Program& program, uint32_t groups, Arena& scratch, double file_bytes = INFINITY);

/// What a document says without arrays.
Span<Expression> read_expressions(Json avatar, Arena& arena, Arena& scratch);
Span<Group> read_groups(Json level, Arena& arena);
bool read_driving(Json document, Arena& arena, Driving& into);
Span<LevelInfo> read_levels(Json document, Arena& arena);
/// Right-handed, also of a left-handed pack.
Framing read_framing(Json document, bool left);
void read_bounds(Json avatar, bool left, double* low, double* high);
bool read_background(Json avatar, double* into);
Rules read_rules(Json avatar, Arena& arena);

/// The skeleton of joints `names` with K expressions and V mesh vertices.
Skeleton read_skeleton(const HeldArrays& arrays, Span<Text> names, uint32_t expressions, double vertices, Arena& arena);
/// Corners [3, F] of the mesh of V vertices.
Span<uint32_t> read_triangles(const HeldArrays& arrays, double vertices, Arena& arena);
void check_groups(Span<Group> groups, const Avatar& avatar, Errors& errors);
/// Sets the error for a joint that the skeleton lacks; "" is no joint.
void check_joint(Text name, const Avatar& avatar, Text field, Errors& errors);
void check_finite(Span<float> values, Text field, Errors& errors);
bool has_affine_row(const float* matrix);
/// The determinant of the 3x3 part of a matrix [4, 4].
double volume(const float* matrix);
/// Elements of 32 bits as floats.
Span<float> floats_of(const Elements& elements, Arena& arena);
/// "[3, 4]".
struct ShownShape {
    char data[96];
    ShownShape(const double* lengths, uint32_t count);
};

constexpr double body_limit = 1u << 30;  // bytes, inflated
/// The most bytes that may be made of a file of that size.
double most_of(double file_bytes, double limit = body_limit);

/// The clips of a document; all of them together take at most `limit` bytes.
Span<ClipData> read_clips(Json listed, const HeldArrays& arrays, const Avatar& avatar, double limit, Arena& arena);

/// The buffer of a kind ("Splats", "Sh", "Projected") of a chunk of a level, by name.
struct ChunkName {
    char data[360];
    size_t size;  // letters; 0 may be one of them
    ChunkName(const Level& level, const char* kind, uint32_t chunk);
    operator Text() const { return Text(data, size); }
};

/// The chunk whose buffer of that kind has that name; -1 if there is none.
int64_t chunk_index(const Level& level, Text kind, Text name);

/// Splits "name[row]"; false for what is no name of the frame. `row` is -1 where there is none.
bool split_source(Text value, Text* name, int64_t* row);

/// Reads a whole pack into `avatar`, whose parts lie in `arena`. False where the error is set.
bool read_pack(const uint8_t* file, size_t bytes, Avatar& avatar, Arena& arena);

/// The avatar of an inflated body: what read_pack does behind gzip, with the size of the file that it came from.
bool read_body(const uint8_t* body, size_t bytes, size_t file_bytes, Avatar& avatar, Arena& arena);

}  // namespace avatar
