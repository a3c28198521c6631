#include "core/log.h"

#include <spdlog/sinks/stdout_color_sinks.h>
#include <spdlog/spdlog.h>
#include <unistd.h>

#include "core/one_line.h"

namespace skein {

void InitLog(const std::string& service, bool verbose) {
  spdlog::drop(service);
  auto logger = spdlog::stderr_color_mt(service);
  // Texts hold names that others chose. In a file each line is a comment, to every shell and in
  // most files of settings, in case a log ends up as one.
  const std::string begin = ::isatty(STDERR_FILENO) == 1 ? "" : "#";
  logger->set_pattern(begin + "%H:%M:%S.%e %n %^%l%$ %v");
  logger->set_level(verbose ? spdlog::level::debug : spdlog::level::info);
  logger->flush_on(spdlog::level::info);
  spdlog::set_default_logger(std::move(logger));
}

void WriteLog(LogLevel level, fmt::string_view format, fmt::format_args args) {
  constexpr spdlog::level::level_enum kLevels[] = {spdlog::level::debug, spdlog::level::info,
                                                   spdlog::level::warn, spdlog::level::err};
  const spdlog::level::level_enum spdlog_level = kLevels[static_cast<int>(level)];
  if (!spdlog::should_log(spdlog_level)) return;
  spdlog::default_logger_raw()->log(spdlog_level, OneLine(fmt::vformat(format, args)));
}

}  // namespace skein
