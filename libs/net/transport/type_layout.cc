#include "transport/type_layout.h"

#include <algorithm>
#include <array>
#include <cstring>
#include <iterator>
#include <regex>
#include <stdexcept>

#include "core/utf8.h"
#include "skein/lcm_types.h"

namespace skein {
namespace {

const std::map<std::string, size_t> kNumberBytes = {{"int8_t", 1},  {"byte", 1},    {"boolean", 1},
                                                    {"int16_t", 2}, {"int32_t", 4}, {"float", 4},
                                                    {"int64_t", 8}, {"double", 8}};

}  // namespace

// Numbers are big endian.
class TypeLayout::Reader {
 public:
  Reader(const uint8_t* data, size_t size) : data_(data), size_(size) {}

  size_t at() const { return at_; }
  size_t left() const { return size_ - at_; }
  bool Skip(size_t num_bytes) {
    if (num_bytes > size_ - at_) return false;
    at_ += num_bytes;
    return true;
  }
  // A signed number of up to eight bytes.
  bool Read(size_t num_bytes, int64_t* number) {
    if (num_bytes > size_ - at_) return false;
    uint64_t bits = data_[at_] >= 0x80 ? ~uint64_t{0} : 0;
    for (size_t i = 0; i < num_bytes; ++i) bits = bits << 8 | data_[at_++];
    *number = static_cast<int64_t>(bits);
    return true;
  }
  bool SkipString() {
    int64_t length = 0;  // with the zero at its end
    if (!Read(4, &length) || length < 1) return false;
    const auto* text = reinterpret_cast<const char*>(data_ + at_);
    if (!Skip(static_cast<size_t>(length))) return false;
    // lcm-gen's code writes a text up to its first zero, so one inside is nothing that LCM sends.
    if (std::memchr(text, 0, static_cast<size_t>(length)) != text + length - 1) return false;
    has_valid_texts_ &= IsUtf8({text, static_cast<size_t>(length) - 1});
    return true;
  }
  bool has_valid_texts() const { return has_valid_texts_; }

 private:
  const uint8_t* data_;
  size_t size_;
  size_t at_ = 0;
  bool has_valid_texts_ = true;
};

const TypeLayout& TypeLayout::Of(std::string_view type_name) {
  static const Layouts layouts = ParseAll();
  const auto found = layouts.find(type_name);
  if (found == layouts.end()) {
    throw std::invalid_argument("there is no LCM type " + std::string(type_name));
  }
  return found->second;
}

std::vector<std::string> TypeLayout::AllNames() {
  std::vector<std::string> names;
  for (const LcmType& type : kLcmTypes) names.push_back(type.name);
  return names;
}

TypeLayout::Layouts TypeLayout::ParseAll() {
  Layouts layouts;
  for (const LcmType& type : kLcmTypes) Parse(type.name, &layouts);
  return layouts;
}

// One type a file, its fields one a line, as lcmtypes/ has them.
const TypeLayout& TypeLayout::Parse(const std::string& type_name, Layouts* layouts) {
  static const std::regex kField(R"(\n\s*(\w+)\s+(\w+)\s*(?:\[\s*(\w+)\s*\])?\s*;)");
  const auto known = layouts->find(type_name);
  if (known != layouts->end()) return known->second;
  const auto* type = std::find_if(std::begin(kLcmTypes), std::end(kLcmTypes),
                                  [&](const LcmType& t) { return type_name == t.name; });
  if (type == std::end(kLcmTypes)) throw std::invalid_argument("there is no LCM type " + type_name);
  const std::string text = type->text;
  const std::string fields = text.substr(text.find('{'));
  TypeLayout layout;
  for (std::sregex_iterator it(fields.begin(), fields.end(), kField), end; it != end; ++it) {
    layout.AddField((*it)[1], (*it)[2], (*it)[3], layouts);
  }
  return layouts->emplace(type_name, std::move(layout)).first->second;
}

void TypeLayout::AddField(const std::string& type, const std::string& name,
                          const std::string& length, Layouts* layouts) {
  Field field;
  field.name = name;
  const auto number = kNumberBytes.find(type);
  if (number != kNumberBytes.end()) {
    field.number_bytes = number->second;
  } else if (type != "string") {
    field.type = &Parse(type, layouts);
  }
  const auto of_length = std::find_if(fields_.begin(), fields_.end(),
                                      [&](const Field& f) { return f.name == length; });
  if (of_length != fields_.end()) {
    field.length_field = static_cast<int>(of_length - fields_.begin());
  } else if (!length.empty()) {
    field.fixed_length = std::stoll(length);
  }
  fields_.push_back(field);
}

std::optional<size_t> TypeLayout::Measure(const uint8_t* data, size_t size) const {
  Reader reader(data, size);
  if (!Skip(&reader)) return std::nullopt;
  return reader.at();
}

bool TypeLayout::HasValidTexts(const uint8_t* data, size_t size) const {
  Reader reader(data, size);
  return Skip(&reader) && reader.has_valid_texts();
}

// The numbers read so far stand in `numbers`, by field.
bool TypeLayout::Skip(Reader* reader) const {
  constexpr size_t kMaxFields = 64;
  std::array<int64_t, kMaxFields> numbers{};
  for (size_t i = 0; i < fields_.size(); ++i) {
    const Field& field = fields_[i];
    const bool is_array = field.length_field >= 0 || field.fixed_length != 1;
    if (field.number_bytes > 0 && !is_array) {
      if (!reader->Read(field.number_bytes, &numbers.at(i))) return false;
      continue;
    }
    const int64_t num =
        field.length_field >= 0 ? numbers.at(field.length_field) : field.fixed_length;
    if (num < 0 || !SkipElements(field, num, reader)) return false;
  }
  return true;
}

// Each element has a byte at least, so the loop ends with the bytes.
bool TypeLayout::SkipElements(const Field& field, int64_t num, Reader* reader) {
  if (field.number_bytes > 0) {
    return num <= static_cast<int64_t>(reader->left() / field.number_bytes) &&
           reader->Skip(static_cast<size_t>(num) * field.number_bytes);
  }
  for (int64_t i = 0; i < num; ++i) {
    if (field.type == nullptr ? !reader->SkipString() : !field.type->Skip(reader)) return false;
  }
  return true;
}

}  // namespace skein
