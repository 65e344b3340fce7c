#include <cmath>

#include "access.h"

namespace avatar {

bool Packed::make(const Buffer& buffer, Arena& arena) {
    buffer_ = &buffer;
    found_ = arena.make<Found>(buffer.sections.size);
    if (found_.empty()) return false;
    words_ = buffer.bytes / 4;
    double at = 0;
    for (size_t i = 0; i < found_.size; i++) {
        found_[i].offset = at;
        at += buffer.sections[i].elements.words();
    }
    return true;
}

size_t Packed::find(Text name) const {
    size_t at = 0;
    while (at < found_.size && buffer_->sections[at].name != name) at++;
    return at;
}

template <class T>
static double largest_of(const uint8_t* data, size_t length) {
    T most = 0;
    for (size_t i = 0; i < length; i++) {
        T value;
        std::memcpy(&value, data + i * sizeof(T), sizeof(T));
        most = value > most ? value : most;
    }
    return length == 0 ? -1 : static_cast<double>(most);
}

double Packed::largest(size_t at) const {
    Found& found = found_[at];
    if (!found.has_largest) {
        const Elements& e = section(at).elements;
        found.largest = e.bits == 8    ? largest_of<uint8_t>(e.data, e.length)
                        : e.bits == 16 ? largest_of<uint16_t>(e.data, e.length)
                                       : largest_of<uint32_t>(e.data, e.length);
        found.has_largest = true;
    }
    return found.largest;
}

bool Packed::is_finite(size_t at, double most) const {
    Found& found = found_[at];
    if (!found.has_size) {
        const Elements& e = section(at).elements;
        double size = 0;
        for (size_t i = 0; i < e.length && e.bits == 32; i++) {
            const double one = std::fabs(static_cast<double>(e.float_at(i)));
            size = one <= most_float32 ? (one > size ? one : size) : INFINITY;  // NaN compares false
            if (!(size <= most_float32)) break;
        }
        found.size = e.bits == 32 ? size : INFINITY;
        found.has_size = true;
    }
    return found.size <= most;
}

const PointerRows& Packed::rows(size_t at) const {
    Found& found = found_[at];
    const Elements& e = section(at).elements;
    if (found.has_rows || e.length == 0) return found.rows;
    found.has_rows = true;
    found.rows = {e[0] == 0, static_cast<double>(e[e.length - 1]), 0};
    uint32_t before = e[0];
    uint32_t longest = 0;
    for (size_t row = 1; row < e.length; row++) {
        const uint32_t now = e[row];
        if (now < before) found.rows.rises = false;
        else longest = now - before > longest ? now - before : longest;
        before = now;
    }
    found.rows.longest = longest;
    return found.rows;
}

}  // namespace avatar
