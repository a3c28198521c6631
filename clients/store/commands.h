// `skein admit`, `skein check`, `skein repair`, `skein clone`: the session folder as a store.
#pragma once

namespace skein {

int RunAdmit(int argc, char** argv);
int RunCheck(int argc, char** argv);
int RunRepair(int argc, char** argv);
int RunClone(int argc, char** argv);

}  // namespace skein
