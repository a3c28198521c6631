// Values and functions that the process which serves a session gives to its API.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "auth/certificate.h"
#include "core/bytes.h"
#include "core/result.h"
#include "http/http.h"
#include "session/heard_processes.h"
#include "session/troubles.h"

namespace skein {

// A browser is let in by any of these links.
struct WebInvitation {
  std::string name;
  std::string secure_link;  // https
  std::string plain_link;   // http; "": there is no such port
};

// How others than this host reach the server. Empty where they do not.
struct PublicAddresses {
  std::string secure;       // "https://10.77.0.1:8471"
  std::string plain;        // "http://10.77.0.1:8472"
  std::string fingerprint;  // of the certificate that a phone may install
  Bytes certificate_der;
};

// Sources of the API's answers. The functions are called on the API's threads and the server's.
struct SessionSource {
  std::string session_id;
  bool live = false;
  std::filesystem::path session_dir;  // "": this process does not share the session folder
  std::filesystem::path page_dir;

  // Gives a blob of a fact, or of a mapper's shape, within the call or later on any thread. Always
  // ends. May block.
  using Done = std::function<void(Result<Bytes>)>;
  using Fetch = std::function<void(const std::string& blob_id, const std::string& owner, Done)>;
  Fetch fetch;
  // Whether a submap without a shape may be shown by its newest model: not while its mapper is
  // about to publish one.
  std::function<bool(int64_t submap_id)> may_use_model;
  // Somebody asks for shapes.
  std::function<void()> on_look;

  // Troubles that a person has to mend; null: they are not known.
  std::function<std::vector<Trouble>()> troubles;
  // Processes that were heard within kSilentProcessS, as of a second ago; null: none is heard here.
  std::function<HeardProcesses()> processes;

  PublicAddresses addresses;
  // Answers a request to /api/uploads/NAME. Null: nothing is uploaded.
  std::function<void(const std::string& name, const HttpRequest& request, Respond respond)> uploads;
  // Whether the view has been given all that the ledger holds: until then it cannot tell that a
  // photo is unknown. Null: it has.
  std::function<bool()> has_read_ledger;
  // Null: nobody is invited here. May block.
  std::function<Result<WebInvitation>(Role role, const std::string& name)> invite;
  // Asks ingest to finish the session, within `within_s` seconds if not 0; calls `done` once the
  // finish has begun. Null: no finish can be asked for.
  std::function<void(double within_s, std::function<void(Status)> done)> finish;
};

}  // namespace skein
