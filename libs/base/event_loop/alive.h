// Callbacks that may be called after their object is gone.
#pragma once

#include <memory>
#include <utility>

namespace skein {

// A member of the object whose callbacks it guards. Guarded callbacks run on the thread that
// destroys the object; Guarded itself may be called by any thread as long as the object is there.
class Alive {
 public:
  Alive() = default;
  Alive(const Alive&) = delete;
  Alive& operator=(const Alive&) = delete;

  // `function`, returning nothing; does nothing once the object is gone.
  template <class Function>
  auto Guarded(Function function) const {
    return [alive = std::weak_ptr<const bool>(token_),
            function = std::move(function)](auto&&... arguments) mutable {
      if (!alive.expired()) function(std::forward<decltype(arguments)>(arguments)...);
    };
  }

 private:
  std::shared_ptr<const bool> token_ = std::make_shared<const bool>(true);
};

}  // namespace skein
