// Paths, and the answers that several parts of the API give.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/bytes.h"
#include "core/result.h"
#include "http/http.h"

namespace skein {

// Parts of a path behind "/api", e.g. {"photos", "3", "thumbnail"}.
using PathParts = std::vector<std::string>;

// Significant digits of a keypoint's place in answers.
constexpr int kPixelDigits = 6;

// A number that is not negative; none of anything else.
std::optional<int64_t> ParseId(const std::string& text);

// 404: "there is no ...".
HttpResponse NoSuch(const std::string& what);
HttpResponse BytesResponse(std::shared_ptr<const Bytes> bytes, const std::string& type);
void AnswerError(const Respond& respond, const Status& status);

}  // namespace skein
