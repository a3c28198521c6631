// Logging through spdlog, to stderr: stdout belongs to a program's results. Only what formats the
// text is compiled where it is used.
#pragma once

#include <fmt/core.h>

#include <cstdint>
#include <string>

namespace skein {

// Makes spdlog's default logger write "time service level text" to stderr. Call once, in main.
void InitLog(const std::string& service, bool verbose);

enum class LogLevel { kDebug, kInfo, kWarn, kError };
void WriteLog(LogLevel level, fmt::string_view format, fmt::format_args args);

// Format strings are fmt's: LogInfo("submap {}: {} photos", id, count).
template <class... T>
void LogDebug(fmt::format_string<T...> format, const T&... args) {
  WriteLog(LogLevel::kDebug, format, fmt::make_format_args(args...));
}
template <class... T>
void LogInfo(fmt::format_string<T...> format, const T&... args) {
  WriteLog(LogLevel::kInfo, format, fmt::make_format_args(args...));
}
template <class... T>
void LogWarn(fmt::format_string<T...> format, const T&... args) {
  WriteLog(LogLevel::kWarn, format, fmt::make_format_args(args...));
}
template <class... T>
void LogError(fmt::format_string<T...> format, const T&... args) {
  WriteLog(LogLevel::kError, format, fmt::make_format_args(args...));
}

// Whether the count-th of events that repeat themselves is logged: each of the first, then each
// power of two.
inline bool IsWorthALine(int64_t count) { return count <= 3 || (count & (count - 1)) == 0; }

}  // namespace skein
