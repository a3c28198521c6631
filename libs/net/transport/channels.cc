#include "transport/channels.h"

#include <cctype>

#include "core/hash.h"

namespace skein {
namespace {

std::string InstanceChannel(const char* prefix, const std::string& instance) {
  constexpr size_t kMaxInstance = 40;
  std::string name = instance;
  if (name.size() > kMaxInstance) {
    name = name.substr(0, 24) + "_" + HashBytes(instance.data(), instance.size()).substr(0, 12);
  }
  for (char& c : name) {
    const auto byte = static_cast<unsigned char>(c);
    c = byte < 128 && std::isalnum(byte) ? static_cast<char>(std::toupper(byte)) : '_';
  }
  return prefix + name;
}

}  // namespace

std::string BlobRequestChannel(const std::string& instance) {
  return InstanceChannel(kBlobRequestPrefix, instance);
}

std::string BlobChunkChannel(const std::string& instance) {
  return InstanceChannel(kBlobChunkPrefix, instance);
}

std::string AgentInstance(const std::string& agent) {
  std::string instance = "agent-";
  for (const char c : agent.substr(0, 32)) {
    instance += std::isalnum(static_cast<unsigned char>(c)) != 0 ? c : '-';
  }
  return instance + "-" + HashBytes(agent.data(), agent.size()).substr(0, 8);
}

}  // namespace skein
