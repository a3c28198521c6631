#pragma once

// For tests and benchmarks: a mapper's way from its submap to the shape that it tells, and who
// looks.

#include <atomic>
#include <functional>
#include <string>
#include <utility>

#include "mapper/shape_teller.h"

namespace skein {

inline NodeOptions ShapeTellingOptions(const std::string& instance) {
  NodeOptions options;
  options.service = "test";
  options.instance = instance;
  options.session_id = "0123456789abcdef";
  return options;
}

// Everything is on one loop, which the owner runs.
struct ShapeTellingMapper {
  ShapeTellingMapper() {
    bus.Subscribe<submap_shape_t>(kSubmapShapeChannel,
                                  [this](const submap_shape_t& shape) { told = shape; });
  }

  // A job of the worker; `done` is called on the loop.
  void Change(std::function<void(SceneMap*)> change, std::function<void()> done) {
    submap.Run(
        "",
        [change = std::move(change)](Submap& submap) {
          change(&submap.map());
          return true;
        },
        [done = std::move(done)](bool) { done(); });
  }

  // Somebody looks, and the teller's second passes.
  void LookAndTick() {
    shape_wanted_t wanted{};
    wanted.author = "viewer";
    viewer.Publish(kShapeWantedChannel, wanted);
    teller.Tick();
  }

  PollLoop loop;
  Bus bus{"memq://", loop};
  Node node{ShapeTellingOptions("mapper-1"), loop, bus};
  Node viewer{ShapeTellingOptions("viewer"), loop, bus};
  WorkerThread worker{loop};
  std::atomic<int64_t> current{0};
  SubmapWorker submap{worker,
                      current,
                      node.steps(),
                      1,
                      SubmapOptions(),
                      [](const std::string& step, const std::string& reason) {
                        throw std::runtime_error(step + ": " + reason);
                      }};
  ShapeDesk desk{node};
  ShapeTeller teller{node, submap, desk, Lease{1, 1}};
  submap_shape_t told{};  // the last one
};

}  // namespace skein
