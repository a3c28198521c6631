#include "export/written_names.h"

#include <algorithm>
#include <cctype>
#include <functional>
#include <set>
#include <utility>
#include <vector>

#include "core/file.h"

namespace skein {
namespace {

// File systems take 255 bytes. The rest is for what tells names apart, and for extensions.
constexpr size_t kMaxFlatBytes = 200;

bool IsBlank(char c) { return std::isspace(static_cast<unsigned char>(c)) != 0; }

std::string WithoutBlanks(std::string name) {
  std::replace_if(name.begin(), name.end(), IsBlank, '_');
  return name;
}

// At most `bytes`, and no part of a UTF-8 character.
std::string CutTo(size_t bytes, std::string name) {
  if (name.size() <= bytes) return name;
  while (bytes > 0 && (static_cast<unsigned char>(name[bytes]) & 0xc0) == 0x80) --bytes;
  name.resize(bytes);
  return name;
}

// "a/b.jpg" -> "a/b", ".jpg"
std::pair<std::string, std::string> Split(const std::string& name) {
  const size_t dot = name.rfind('.');
  const size_t slash = name.rfind('/');
  const bool has_extension =
      dot != std::string::npos && (slash == std::string::npos || dot > slash + 1) && dot > 0;
  return {name.substr(0, has_extension ? dot : name.size()), has_extension ? name.substr(dot) : ""};
}

// Names that `change` leaves alone are theirs whoever else becomes the same.
WrittenNames Rename(const Reconstruction& model,
                    const std::function<std::string(const std::string&)>& change) {
  WrittenNames names;
  std::set<std::string> taken;
  std::vector<ImageId> changed, ids = model.RegImageIds();
  std::sort(ids.begin(), ids.end());
  for (const ImageId id : ids) {
    const std::string& name = model.Image(id).Name();
    if (change(name) != name) {
      changed.push_back(id);
    } else {
      taken.insert(names[id] = name);
    }
  }
  for (const ImageId id : changed) {
    const std::string name = change(model.Image(id).Name());
    const auto [stem, extension] = Split(name);
    std::string free = name;
    for (int i = 2; !taken.insert(free).second; ++i) {
      free = stem + "~" + std::to_string(i) + extension;
    }
    names[id] = free;
  }
  return names;
}

}  // namespace

WrittenNames NamesWithoutBlanks(const Reconstruction& model) {
  return Rename(model, WithoutBlanks);
}

int NumNamesWithBlanks(const Reconstruction& model) {
  const std::vector<ImageId>& ids = model.RegImageIds();
  return static_cast<int>(std::count_if(ids.begin(), ids.end(), [&](ImageId id) {
    const std::string& name = model.Image(id).Name();
    return std::any_of(name.begin(), name.end(), IsBlank);
  }));
}

WrittenNames FlatNames(const Reconstruction& model, const std::string& extension) {
  return Rename(model, [&](const std::string& name) {
    std::string flat = WithoutBlanks(Split(name).first);
    std::replace(flat.begin(), flat.end(), '/', '_');
    return CutTo(kMaxFlatBytes, std::move(flat)) + extension;
  });
}

void RenameImages(const WrittenNames& names, Reconstruction* model) {
  for (const auto& [id, name] : names) model->Image(id).SetName(name);
}

Status WriteNames(const Reconstruction& model, const WrittenNames& names,
                  const std::filesystem::path& file) {
  std::string text;
  for (const auto& [id, name] : names) text += name + "\t" + model.Image(id).Name() + "\n";
  return WriteFileAtomic(file.string(), text);
}

}  // namespace skein
