// How LCM's types are laid out on the wire, from their .lcm files. lcm-gen's decoders trust the
// lengths that they read: what a peer sent is measured here before one of them runs.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace skein {

class TypeLayout {
 public:
  // Layout of one of the types in lcmtypes/, by its name without the package. Lives as long as the
  // process. Throws std::invalid_argument for another name.
  static const TypeLayout& Of(std::string_view type_name);
  static std::vector<std::string> AllNames();

  // Bytes of the value (without a fingerprint) that begins at `data`; nullopt if it does not fit
  // into `size`, a length is negative, or a string lacks the zero at its end. Allocates nothing
  // that depends on the bytes. Its cost is at most that of `size` numbers.
  std::optional<size_t> Measure(const uint8_t* data, size_t size) const;
  // Whether it fits, and all its strings are valid UTF-8 (arrays of bytes are no strings).
  bool HasValidTexts(const uint8_t* data, size_t size) const;

 private:
  struct Field {
    std::string name;
    size_t number_bytes = 0;           // 0: a string, or a value of `type`
    const TypeLayout* type = nullptr;  // null: a number or a string
    int length_field = -1;             // of an array: the field with its length; -1: fixed_length
    int64_t fixed_length = 1;
  };
  class Reader;

  using Layouts = std::map<std::string, TypeLayout, std::less<>>;
  static Layouts ParseAll();
  // With those that its fields have.
  static const TypeLayout& Parse(const std::string& type_name, Layouts* layouts);
  void AddField(const std::string& type, const std::string& name, const std::string& length,
                Layouts* layouts);
  bool Skip(Reader* reader) const;
  static bool SkipElements(const Field& field, int64_t num, Reader* reader);

  std::vector<Field> fields_;
};

}  // namespace skein
