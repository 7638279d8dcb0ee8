#include "train_derail/ros/run_history.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace train_derail::ros_face {

namespace {

std::size_t bytes_of(const RunHistory::Moment& moment) {
  return sizeof(moment) + sizeof(outcome::Outcome) + moment.now.cars.size() * sizeof(simulation::CarSnapshot) +
         moment.now.couplers.size() * sizeof(simulation::CouplerSnapshot);
}

}  // namespace

void RunHistory::clear() {
  moments_.clear();
  points_ = 0;
  every_ = 1;
}

void RunHistory::add(const simulation::Snapshot& now, std::shared_ptr<const outcome::Outcome> outcome) {
  if (bytes_max_ == 0) return;
  // The newest moment that is not on the coarser grid gives way to this one.
  if (points_ > 0 && (points_ - 1) % every_ != 0) moments_.pop_back();
  moments_.push_back({now, std::move(outcome)});
  ++points_;
  if (moments_.size() > 2 && moments_.size() * bytes_of(moments_.back()) > bytes_max_) thin_out();
}

void RunHistory::conclude(std::shared_ptr<const outcome::Outcome> outcome) {
  if (!moments_.empty()) moments_.back().outcome = std::move(outcome);
}

void RunHistory::thin_out() {
  const bool newest_is_on_grid = (points_ - 1) % (2 * every_) == 0;
  std::size_t kept = 0;
  for (std::size_t i = 0; i < moments_.size(); ++i) {
    const bool newest = i + 1 == moments_.size();
    if (i % 2 != 0 && !(newest && !newest_is_on_grid)) continue;
    if (kept != i) moments_[kept] = std::move(moments_[i]);
    ++kept;
  }
  moments_.resize(kept);
  every_ *= 2;
}

const RunHistory::Moment* RunHistory::nearest(double time) const {
  if (moments_.empty()) return nullptr;
  const auto after = std::lower_bound(moments_.begin(), moments_.end(), time,
                                      [](const Moment& m, double t) { return m.now.time < t; });
  if (after == moments_.end()) return &moments_.back();
  if (after == moments_.begin()) return &*after;
  const auto before = after - 1;
  return time - before->now.time <= after->now.time - time ? &*before : &*after;
}

}  // namespace train_derail::ros_face
