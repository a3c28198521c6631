// Notes of launch.sh in run/: addresses of the session, for commands that are given its folder.
//
//   run/lcm_url     the URL
//   run/web_public  addresses at which browsers are let in, https first
//
// An address a line; the last line is "mark " and the mark of all before it (HomeMarkOf, purpose:
// the file's path in the folder). A folder that somebody sent may name any address, and a command
// that follows it tells that host which session is looked at, or hands a pass to it. So an address
// of another host is taken only if the mark is this user's.
#pragma once

#include <string>
#include <vector>

#include "core/result.h"
#include "ledger/session_folder.h"

namespace skein {

// Replaces the note. Fails where it cannot be written or marked; without a mark it is written all
// the same.
Status NoteLaunchedUrl(const SessionPaths& paths, const std::string& url);
Status NoteBrowserAddresses(const SessionPaths& paths, const std::vector<std::string>& addresses);

// The URL on which launch.sh runs, or last ran, the session of that folder; "" if it never did.
// kFailedPrecondition: the URL leaves this host, and the note has no mark of this user. kDataLoss:
// the note holds no URL. Both texts say what to do.
Result<std::string> LaunchedUrl(const SessionPaths& paths);

// Addresses at which browsers are let in; empty if nowhere. kFailedPrecondition: the note has no
// mark of this user; the text says what to do.
Result<std::vector<std::string>> BrowserAddresses(const SessionPaths& paths);

// `skein launched`: writes the notes.
int RunLaunched(int argc, char** argv);

}  // namespace skein
