#include "model/planar_rest.hpp"

#include <algorithm>
#include <cmath>

#include "train_derail/model/ground_law.hpp"
#include "train_derail/model/state.hpp"

namespace train_derail::model {

namespace {

constexpr int kSteps = 10;  // between two looks at who is slow

}  // namespace

PlanarRest::PlanarRest(const inputs::Ground& law, const std::vector<Car>& cars, const Couplers& couplers,
                       const TruckArrays& trucks)
    : law_(law),
      couplers_(couplers),
      trucks_(trucks),
      rest_(cars.size()),
      touched_(cars.size(), false),
      fresh_(cars.size(), false),
      rolling_(busy_blocks(cars.size()), false) {
  for (const Car& c : cars) {
    radius_.push_back(std::hypot(0.5 * c.length, 0.5 * c.width));
    half_spacing_.push_back(0.5 * c.truck_spacing);
    mass_.push_back(c.mass);
    inertia_.push_back(c.yaw_inertia);
  }
  for (auto* a : {&fx_, &fy_, &moment_, &vx_, &vy_, &omega_, &seen_x_, &seen_y_, &seen_cosine_, &seen_sine_})
    a->assign(cars.size(), 0.0);
  find_busy();
}

bool PlanarRest::off_rails(std::size_t car) const {
  const auto off = [this](std::size_t truck) { return trucks_.on_track[truck] == 0.0 && trucks_.guided[truck] == 0.0; };
  return off(car) && off(mass_.size() + car);
}

void PlanarRest::find_busy() {
  const int n = static_cast<int>(mass_.size());
  std::vector<bool> blocks(rolling_.size(), false);
  const auto mark = [&blocks](int car) { blocks[busy_block(car)] = true; };
  joined_.clear();
  lying_cars_.clear();
  looked_at_.clear();
  for (int k = 0; k < n; ++k) {
    if (!lies(k)) {
      if (!rolling_[busy_block(k)]) mark(k);
      continue;
    }
    lying_cars_.push_back(k);
    const bool ahead = k > 0 && !lies(k - 1) && !couplers_.broken(k - 1);
    const bool behind = k + 1 < n && !lies(k + 1) && !couplers_.broken(k);
    if (!ahead && !behind) continue;
    mark(k);
    joined_.push_back(k);
  }
  for (const int k : lying_cars_)
    if (blocks[busy_block(k)]) looked_at_.push_back(k);
  busy_.set(blocks, n);
}

void PlanarRest::leave_out(const std::vector<bool>& rolling) {
  rolling_ = rolling;
  find_busy();
}

void PlanarRest::begin(const Wrenches& sum) {
  for (const int car : touched_cars_) touched_[static_cast<std::size_t>(car)] = false;
  touched_before_.swap(touched_cars_);
  touched_cars_.clear();
  for (const int car : joined_) touch(car, sum);
  for (const int car : touched_before_) {
    const auto k = static_cast<std::size_t>(car);
    if (lies(car) && (fresh_[k] || moves(k))) touch(car, sum);
    fresh_[k] = false;
  }
}

void PlanarRest::touch(int car, const Wrenches& sum) {
  const auto k = static_cast<std::size_t>(car);
  if (touched_[k]) return;
  touched_[k] = true;
  touched_cars_.push_back(car);
  sum.fx[k] = fx_[k];
  sum.fy[k] = fy_[k];
  sum.moment[k] = moment_[k];
}

double PlanarRest::need(std::size_t car, const CarColumns& cars, double fx, double fy, double moment) const {
  const double along = 0.5 * (fx * cars.cosine[car] + fy * cars.sine[car]);
  const double across = 0.5 * (fy * cars.cosine[car] - fx * cars.sine[car]);
  const double turning = 0.5 * moment / half_spacing_[car];
  double most = 0.0;
  for (const bool front : {true, false}) {
    const std::size_t truck = front ? car : mass_.size() + car;
    const double aside = front ? across + turning : across - turning;
    const double squared = along * along + aside * aside;
    if (!(squared > 0.0)) continue;
    const double mu = law_.off_track_law == inputs::OffTrackLaw::by_slip
                          ? slip_friction<double>(law_, squared, aside, trucks_.offset[truck])
                          : law_.off_track_friction;
    most = std::max(most, std::sqrt(squared) / (mu * trucks_.patch[truck] * trucks_.ground_load[truck]));
  }
  return most;
}

bool PlanarRest::push(std::size_t k, double h, const CarColumns& cars, const Wrenches& sum) {
  vx_[k] += h * sum.fx[k] / mass_[k];
  vy_[k] += h * sum.fy[k] / mass_[k];
  omega_[k] += h * sum.moment[k] / inertia_[k];
  const double steps = need(k, cars, mass_[k] * vx_[k] / h, mass_[k] * vy_[k] / h, inertia_[k] * omega_[k] / h);
  const double left = steps > 1.0 ? 1.0 - 1.0 / steps : 0.0;
  vx_[k] *= left;
  vy_[k] *= left;
  omega_[k] *= left;
  return !(std::hypot(vx_[k], vy_[k]) + radius_[k] * std::abs(omega_[k]) < law_.rest_speed);
}

void PlanarRest::hold(double h, const CarColumns& cars, const Wrenches& sum) {
  for (const int car : touched_cars_) {
    const auto k = static_cast<std::size_t>(car);
    if (!push(k, h, cars, sum)) continue;
    rest_.wake(k);
    let_go_.push_back(k);
    // The forces of the step do their work at half of that speed.
    kept_ += 0.5 * (vx_[k] * (mass_[k] * vx_[k] - h * sum.fx[k]) + vy_[k] * (mass_[k] * vy_[k] - h * sum.fy[k]) +
                    omega_[k] * (inertia_[k] * omega_[k] - h * sum.moment[k]));
  }
  if (let_go_.empty()) return;
  ++changes_;
  find_busy();
}

void PlanarRest::look(double h, const CarColumns& cars) {
  if (!(law_.rest_speed > 0.0) || ++unlooked_ < kSteps) return;
  unlooked_ = 0;
  for (std::size_t k = 0; k < mass_.size(); ++k) {
    if (rolling_[busy_block(static_cast<std::ptrdiff_t>(k))] || lies(static_cast<int>(k)) || !off_rails(k)) continue;
    // How far any point of it has come since it was seen first: bodies that are pressed together tremble.
    const double turned = cars.sine[k] * seen_cosine_[k] - cars.cosine[k] * seen_sine_[k];
    const double way = std::hypot(cars.x[k] - seen_x_[k], cars.y[k] - seen_y_[k]) + radius_[k] * std::abs(turned);
    const bool slow = way < law_.rest_speed * Rest::kTime;
    if (!slow) {
      seen_x_[k] = cars.x[k];
      seen_y_[k] = cars.y[k];
      seen_cosine_[k] = cars.cosine[k];
      seen_sine_[k] = cars.sine[k];
    }
    if (!rest_.note(k, slow, kSteps * h)) continue;
    const double rate = 1.0 / Rest::kTime;
    if (need(k, cars, rate * mass_[k] * cars.vx[k], rate * mass_[k] * cars.vy[k], rate * inertia_[k] * cars.omega[k]) <=
        1.0)
      to_lie_.push_back(k);
  }
}

void PlanarRest::still(double h, double* accelerations) {
  const std::size_t n = mass_.size();
  for (const int car : lying_cars_) {
    const auto k = static_cast<std::size_t>(car);
    accelerations[k] = accelerations[n + k] = accelerations[2 * n + k] = 0.0;
  }
  for (const std::size_t k : let_go_) {
    accelerations[k] = vx_[k] / h;
    accelerations[n + k] = vy_[k] / h;
    accelerations[2 * n + k] = omega_[k] / h;
    vx_[k] = vy_[k] = omega_[k] = 0.0;
  }
  let_go_.clear();
}

double PlanarRest::lay(double* y) {
  double taken = -kept_;
  kept_ = 0.0;
  MotionMap q = motion(y, static_cast<Index>(mass_.size()));
  for (const std::size_t k : to_lie_) {
    const auto car = static_cast<Index>(k);
    taken += 0.5 * mass_[k] * (q(car, VX) * q(car, VX) + q(car, VY) * q(car, VY)) +
             0.5 * inertia_[k] * q(car, OMEGA) * q(car, OMEGA);
    q(car, VX) = q(car, VY) = q(car, OMEGA) = 0.0;
    rest_.lay(k);
  }
  return taken;
}

void PlanarRest::keep(const Wrenches& sum) {
  const auto keep_forces = [&](std::size_t k) {
    fx_[k] = sum.fx[k];
    fy_[k] = sum.fy[k];
    moment_[k] = sum.moment[k];
  };
  for (const int car : looked_at_) keep_forces(static_cast<std::size_t>(car));
  for (const std::size_t k : to_lie_) keep_forces(k);
  if (to_lie_.empty()) return;
  // What pushes them even so is looked at once.
  for (const std::size_t k : to_lie_) {
    fresh_[k] = true;
    if (!touched_[k]) touched_cars_.push_back(static_cast<int>(k));
    touched_[k] = true;
  }
  to_lie_.clear();
  ++changes_;
  find_busy();
}

void PlanarRest::walk(files::Archive& archive) {
  rest_.walk(archive);
  archive.value("unlooked", unlooked_);
  archive.list("touched", touched_cars_, [&](int& car) { archive.value("car", car); });
  archive.flags("fresh", fresh_);
  archive.column("seen_x", seen_x_);
  archive.column("seen_y", seen_y_);
  archive.column("seen_cosine", seen_cosine_);
  archive.column("seen_sine", seen_sine_);
  archive.column("own_x", vx_);
  archive.column("own_y", vy_);
  archive.column("own_omega", omega_);
  archive.column("held_x", fx_);
  archive.column("held_y", fy_);
  archive.column("held_moment", moment_);
  if (!archive.restoring()) return;
  if (!(law_.rest_speed > 0.0)) rest_.wake_all();
  for (const int car : touched_cars_) touched_[static_cast<std::size_t>(car)] = true;
  ++changes_;
  find_busy();
}

}  // namespace train_derail::model
