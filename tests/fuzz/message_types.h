// All types of lcmtypes/, as a tuple.
#pragma once

#include <tuple>
#include <utility>

#include "skein/model_check_t.hpp"
#include "skein/sim3_options_t.hpp"
#include "skein/station_t.hpp"
#include "skein/two_view_t.hpp"
#include "transport/channels.h"

namespace skein::fuzz {

using MessageTypes =
    std::tuple<advice_t, blob_chunk_t, blob_request_t, candidates_t, command_reply_t, command_t,
               configuration_t, demand_t, fact_header_t, failure_t, features_t, finish_t,
               guidance_t, heartbeat_t, image_ack_t, image_offer_t, image_t, ledger_head_t,
               ledger_range_t, ledger_request_t, matches_t, merge_t, model_check_t,
               photo_diagnosis_t, registration_t, seed_t, shape_wanted_t, shared_reply_t,
               shared_request_t, sim3_options_t, station_t, submap_end_t, submap_lease_t,
               submap_model_t, submap_shape_t, submap_status_t, submit_reply_t, two_view_t,
               work_failed_t, work_request_t, work_t>;
inline constexpr size_t kNumMessageTypes = std::tuple_size_v<MessageTypes>;

// Calls fn(T()) with the type of that number.
template <class Fn, size_t... kTypes>
void WithMessageType(size_t number, Fn fn, std::index_sequence<kTypes...>) {
  ((number == kTypes ? fn(std::tuple_element_t<kTypes, MessageTypes>()) : void()), ...);
}
template <class Fn>
void WithMessageType(size_t number, Fn fn) {
  WithMessageType(number, fn, std::make_index_sequence<kNumMessageTypes>());
}

}  // namespace skein::fuzz
