// How sections are stored.
#include <cstdio>

#include "read.h"

namespace avatar {

static constexpr size_t few_planes = 16;  // that are read side by side

template <size_t size>
static void gather_few(const uint8_t* from, Span<uint8_t> into) {
    const size_t records = into.size / size;
    uint8_t* to = into.data;
    for (size_t r = 0; r < records; r++, to += size) {
        for (size_t c = 0; c < size; c++) to[c] = from[c * records + r];
    }
}

/// Puts planes together: byte c of record r is from[c * records + r].
static void gather(const uint8_t* from, Span<uint8_t> into, size_t size) {
    const size_t records = into.size / size;
    if (size == 1) {
        if (records > 0) std::memcpy(into.data, from, records);
        return;
    }
    if (size == 2) return gather_few<2>(from, into);
    if (size == 3) return gather_few<3>(from, into);
    if (size == 4) return gather_few<4>(from, into);
    for (size_t begin = 0; begin < size; begin += few_planes) {
        const size_t end = begin + few_planes < size ? begin + few_planes : size;
        for (size_t r = 0; r < records; r++) {
            for (size_t c = begin; c < end; c++) into[r * size + c] = from[c * records + r];
        }
    }
}

/// Adds to each element the one before it, modulo 2^bits.
template <size_t width>
static void sum_up(Span<uint8_t> data) {
    uint32_t sum = 0;
    for (size_t at = 0; at < data.size; at += width) {
        for (size_t b = 0; b < width; b++) sum += static_cast<uint32_t>(data[at + b]) << (8 * b);
        for (size_t b = 0; b < width; b++) data[at + b] = static_cast<uint8_t>(sum >> (8 * b));
    }
}

static Elements of_words(Span<uint32_t> words) {
    Elements made;
    made.data = reinterpret_cast<const uint8_t*>(words.data);  // hosts are little-endian: see CMakeLists.txt
    made.bits = 32;
    made.length = static_cast<uint32_t>(words.size);
    return made;
}

static Elements pointer(const Reading& reading, TensorEntry at, double count, Text where, Arena& into) {
    const double rows = count - 1, length = at.end - at.begin;
    const double size = rows > 0 ? static_cast<double>(static_cast<int64_t>(length / rows)) : 1;
    if (rows < 0 || (size != 1 && size != 2 && size != 4) || size * rows != length) {
        reading.errors.set(where, "stores %.0f bytes for %.0f counts", length, rows);
        return {};
    }
    Span<uint8_t> counts = reading.scratch.make<uint8_t>(static_cast<size_t>(length));
    Span<uint32_t> ends = into.make<uint32_t>(static_cast<size_t>(count));
    if (reading.failed()) return {};
    gather(reading.body + static_cast<size_t>(at.begin), counts, static_cast<size_t>(size));
    Elements steps;
    steps.data = counts.data;
    steps.bits = 8 * static_cast<uint32_t>(size);
    uint64_t end = 0;
    for (size_t row = 0; row + 1 < ends.size; row++) {
        end += steps[row];
        ends[row + 1] = static_cast<uint32_t>(end);
    }
    if (end > UINT32_MAX) {
        reading.errors.set(where, "counts more than 2^32 entries");
        return {};
    }
    return of_words(ends);
}

Elements decode_elements(const Reading& reading, TensorEntry at, Text codec, uint32_t bits, double count, uint32_t record,
                         Text where, Arena& into) {
    if (codec == "pointer") return pointer(reading, at, count, where, into);
    const size_t width = bits / 8;
    const double size = count * static_cast<double>(width), stored = at.end - at.begin;
    if (stored != size) {
        reading.errors.set(where, "stores %.0f bytes; %.0f elements of %u bits take %.0f", stored, count, bits, size);
        return {};
    }
    const bool planes = codec == "planes";
    if (planes && static_cast<uint64_t>(count) % record != 0) {
        reading.errors.set(where, "has %.0f elements, which are no whole records of %u", count, record);
        return {};
    }
    Span<uint8_t> data = into.make_unset<uint8_t>(static_cast<size_t>(size));
    if (reading.failed()) return {};
    const uint8_t* from = reading.body + static_cast<size_t>(at.begin);
    if (codec == "raw" && data.size > 0) std::memcpy(data.data, from, data.size);
    if (codec != "raw") gather(from, data, (planes ? record : 1) * width);
    if (codec == "delta") width == 1 ? sum_up<1>(data) : width == 2 ? sum_up<2>(data) : sum_up<4>(data);
    Elements made;
    made.data = data.data;
    made.bits = bits;
    made.length = static_cast<uint32_t>(count);
    return made;
}

Elements narrowed(Arena& arena, Span<uint32_t> numbers, uint32_t bits) {
    if (bits == 32) return of_words(arena.copy(numbers.data, numbers.size));
    const size_t width = bits / 8;
    Span<uint8_t> data = arena.make<uint8_t>(numbers.size * width);
    for (size_t i = 0; i < data.size; i++) data[i] = static_cast<uint8_t>(numbers[i / width] >> (8 * (i % width)));
    Elements made;
    made.data = data.data;
    made.bits = bits;
    made.length = static_cast<uint32_t>(data.size / width);
    return made;
}

}  // namespace avatar
