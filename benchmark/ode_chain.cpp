// A train in the Open Dynamics Engine (ODE), as a game would have it, for scripts/compare_cost.py: boxes on a plane
// with Coulomb friction, rigid bars between their pins, contact of everything with everything, fixed steps, an
// iterative solver. It knows no slack, no stiffness and no swing stop, and its friction acts at the corners of the
// boxes.
//
// Standard input: coupler length [m], friction before and past x = 0, speed [m/s], yaw rate of the first car [rad/s],
// step [s], speed at which the train is at rest [m/s], longest time [s], iterations a step (0: the direct solver); then
// a line a car, the foremost first: mass [kg], yaw inertia [kg m2], length and width [m]. Standard output: one object
// of JSON.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <iostream>
#include <vector>

#include <ode/ode.h>

namespace {

constexpr dReal kGravity = 9.80665;  // m/s2
// Of a body, from floor to roof about as in config/types/car_bodies.yaml, and of couplers, 33 in [m].
constexpr dReal kHeight = 3.0, kPinHeight = 0.84;

struct Run {
  double coupler, on_track, off_track, speed, yaw_rate, step, rest, time_max;
  int iterations;
};

struct Car {
  double mass, yaw_inertia, length, width;
};

class Train {
 public:
  Train(const Run& run, const std::vector<Car>& cars) : run_(run) {
    dWorldSetGravity(world_, 0.0, 0.0, -kGravity);
    if (run.iterations > 0) dWorldSetQuickStepNumIterations(world_, run.iterations);
    dCreatePlane(space_, 0.0, 0.0, 1.0, 0.0);
    double x = 0.0;
    for (std::size_t k = 0; k < cars.size(); ++k) {
      if (k > 0) x -= 0.5 * (cars[k - 1].length + cars[k].length) + run.coupler;
      add(cars[k], x);
      if (k > 0) couple(bodies_[k - 1], bodies_[k], x + 0.5 * cars[k].length);
    }
    dBodySetAngularVel(bodies_.front(), 0.0, 0.0, run.yaw_rate);
  }
  ~Train() {
    dJointGroupDestroy(touches_);
    dSpaceDestroy(space_);
    dWorldDestroy(world_);
  }
  Train(const Train&) = delete;
  Train& operator=(const Train&) = delete;

  void step() {
    dSpaceCollide(space_, this, [](void* self, dGeomID a, dGeomID b) { static_cast<Train*>(self)->touch(a, b); });
    if (run_.iterations > 0) dWorldQuickStep(world_, run_.step);
    else dWorldStep(world_, run_.step);
    dJointGroupEmpty(touches_);
  }

  double fastest() const {
    double most = 0.0;
    for (const dBodyID b : bodies_) {
      const dReal* v = dBodyGetLinearVel(b);
      most = std::max(most, std::hypot(v[0], v[1]));
    }
    return most;
  }
  int past_pod() const {
    int count = 0;
    for (const dBodyID b : bodies_) count += dBodyGetPosition(b)[0] > 0.0 ? 1 : 0;
    return count;
  }

 private:
  void add(const Car& car, double x) {
    const dBodyID body = dBodyCreate(world_);
    const double m = car.mass / 12.0, roll = m * (car.width * car.width + kHeight * kHeight),
                 pitch = m * (car.length * car.length + kHeight * kHeight);
    dMass mass;
    dMassSetParameters(&mass, car.mass, 0.0, 0.0, 0.0, roll, pitch, car.yaw_inertia, 0.0, 0.0, 0.0);
    dBodySetMass(body, &mass);
    dBodySetPosition(body, x, 0.0, 0.5 * kHeight);
    dBodySetLinearVel(body, run_.speed, 0.0, 0.0);
    dGeomSetBody(dCreateBox(space_, car.length, car.width, kHeight), body);
    bodies_.push_back(body);
  }
  /// `front`: x of the front pin of the trailing car.
  void couple(dBodyID lead, dBodyID trail, double front) {
    const dJointID bar = dJointCreateDBall(world_, nullptr);
    dJointAttach(bar, lead, trail);
    dJointSetDBallAnchor1(bar, front + run_.coupler, 0.0, kPinHeight);
    dJointSetDBallAnchor2(bar, front, 0.0, kPinHeight);
  }
  void touch(dGeomID a, dGeomID b) {
    constexpr int kMost = 8;
    dContactGeom places[kMost];
    const int count = dCollide(a, b, kMost, places, sizeof(dContactGeom));
    for (int i = 0; i < count; ++i) {
      const dBodyID body = dGeomGetBody(a) != nullptr ? dGeomGetBody(a) : dGeomGetBody(b);
      dContact contact{};
      contact.geom = places[i];
      contact.surface.mode = dContactApprox1;  // friction is a share of the normal force
      contact.surface.mu = dBodyGetPosition(body)[0] > 0.0 ? run_.off_track : run_.on_track;
      dJointAttach(dJointCreateContact(world_, touches_, &contact), dGeomGetBody(a), dGeomGetBody(b));
    }
  }

  const Run run_;
  const dWorldID world_ = dWorldCreate();
  const dSpaceID space_ = dSweepAndPruneSpaceCreate(nullptr, dSAP_AXES_XYZ);
  const dJointGroupID touches_ = dJointGroupCreate(0);
  std::vector<dBodyID> bodies_;
};

}  // namespace

int main() {
  Run run{};
  if (!(std::cin >> run.coupler >> run.on_track >> run.off_track >> run.speed >> run.yaw_rate >> run.step >> run.rest >>
        run.time_max >> run.iterations)) {
    std::cerr << "ode_chain: no run on standard input\n";
    return 2;
  }
  std::vector<Car> cars;
  for (Car c{}; std::cin >> c.mass >> c.yaw_inertia >> c.length >> c.width;) cars.push_back(c);
  if (cars.empty()) {
    std::cerr << "ode_chain: no cars on standard input\n";
    return 2;
  }
  dInitODE2(0);
  long steps = 0;
  {
    Train train(run, cars);
    double t = 0.0;
    for (; t < run.time_max && train.fastest() >= run.rest; t = static_cast<double>(++steps) * run.step) train.step();
    std::printf("{\"stop_time\": %.3f, \"steps\": %ld, \"cars_past_pod\": %d}\n", t, steps, train.past_pod());
  }
  dCloseODE();
  return 0;
}
