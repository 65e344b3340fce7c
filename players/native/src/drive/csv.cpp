#include "recording.h"

namespace avatar {

Csv::Csv(Text text, Arena& arena) : text_(text), arena_(arena), fields_(arena.allocator(), arena.errors()) {
    if (text.begins("\xEF\xBB\xBF")) at_ = 3;  // a byte order mark
}

bool Csv::next(CsvRow* row) {
    if (at_ >= text_.size || arena_.errors().any()) return false;
    row->line = line_;
    fields_.set_size(0);
    for (;;) {
        if (!(letter(at_) == '"' ? quoted() : plain())) return false;
        if (letter(at_) != ',') break;
        at_++;
    }
    if (letter(at_) == '\r') at_++;
    if (letter(at_) == '\n') at_++;
    line_++;
    const bool empty = fields_.size() == 1 && fields_[0].size == 0;
    row->fields = {fields_.data(), empty ? 0 : fields_.size()};
    return true;
}

bool Csv::plain() {
    const size_t begin = at_;
    while (at_ < text_.size && letter(at_) != ',' && letter(at_) != '\n' && letter(at_) != '\r') at_++;
    return fields_.add(Text(text_.data + begin, at_ - begin));
}

bool Csv::quoted() {
    const size_t begin = at_ + 1;
    const uint32_t first = line_;
    size_t doubled = 0;
    for (at_ = begin;; at_ += 2, doubled++) {
        while (at_ < text_.size && letter(at_) != '"') {
            if (letter(at_) == '\n') line_++;
            at_++;
        }
        if (at_ >= text_.size) {
            arena_.errors().set("", "line %u: a quotation mark is not closed", first);
            return false;
        }
        if (letter(at_ + 1) != '"') break;
    }
    Text value(text_.data + begin, at_ - begin);
    if (doubled > 0) {
        Span<char> made = arena_.make<char>(value.size);
        if (made.size < value.size) return false;
        size_t size = 0;
        for (uint32_t i = 0; i < value.size; i++) {
            made[size++] = value.data[i];
            if (value.data[i] == '"') i++;
        }
        value = Text(made.data, size);
    }
    at_++;
    if (at_ < text_.size && letter(at_) != ',' && letter(at_) != '\r' && letter(at_) != '\n') {
        arena_.errors().set("", "line %u: a comma is missing behind a quotation mark", first);
        return false;
    }
    return fields_.add(value);
}

}  // namespace avatar
