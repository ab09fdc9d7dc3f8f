/* A controller manager in small: the package's class through its life, beside a loop of its own around the plain C.

   NAME, SPACE, SIZE_MEASURED, SIZE_COMMANDS and CANCELLING (fields of the outputs) are macros of the compiler. */
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <limits>
#include <new>
#include <string>

#include "friction_compensation.hpp"

#define JOIN_(a, b) a##b
#define JOIN(a, b) JOIN_(a, b)
#define OWN(part) JOIN(NAME, part)

static long allocated = 0;

extern "C" {
void * __real_malloc(std::size_t);
void * __real_calloc(std::size_t, std::size_t);
void * __real_realloc(void *, std::size_t);
void * __wrap_malloc(std::size_t n) { return ++allocated, __real_malloc(n); }
void * __wrap_calloc(std::size_t n, std::size_t m) { return ++allocated, __real_calloc(n, m); }
void * __wrap_realloc(void * old, std::size_t n) { return ++allocated, __real_realloc(old, n); }
}
void * operator new(std::size_t n) { return std::malloc(n); }
void operator delete(void * old) noexcept { std::free(old); }
void operator delete(void * old, std::size_t) noexcept { std::free(old); }

using controller_interface::CallbackReturn;
using controller_interface::return_type;
static const double NOTHING = std::numeric_limits<double>::quiet_NaN();
static const rclcpp_lifecycle::State UNKNOWN;

static void require(bool good, const char * what)
{
  if (!good) {
    std::printf("failed: %s\n", what);
    std::exit(1);
  }
}

static double noise(unsigned & seed)
{
  seed = seed * 1664525U + 1013904223U;
  return seed / 4294967296.0 - 0.5;
}

int main()
{
  SPACE::FrictionCompensation controller;
  auto & parameters = controller.get_node()->parameters;
  parameters["compensation"] = 3.0;
  require(controller.on_init() == CallbackReturn::SUCCESS, "on_init");
  require(controller.on_configure(UNKNOWN) != CallbackReturn::SUCCESS, "a compensation of 3 is refused");
  parameters["compensation"] = 0.5;
  parameters["max_compensation"] = std::vector<double>(SIZE_COMMANDS + 1, 1.0);
  require(controller.on_configure(UNKNOWN) != CallbackReturn::SUCCESS, "a limit too many is refused");
  parameters["max_compensation"] = std::vector<double>(SIZE_COMMANDS, NOTHING);
  require(controller.on_configure(UNKNOWN) != CallbackReturn::SUCCESS, "a limit that is no number is refused");
  parameters["max_compensation"] = std::vector<double>(SIZE_COMMANDS, LIMIT);
  controller.update_rate = 97;
  require(controller.on_configure(UNKNOWN) != CallbackReturn::SUCCESS, "another rate is refused");
  controller.update_rate = 1000;
  require(controller.on_configure(UNKNOWN) == CallbackReturn::SUCCESS, "on_configure");

  const auto measured_names = controller.state_interface_configuration().names;
  const auto command_names = controller.command_interface_configuration().names;
  require(measured_names.size() == SIZE_MEASURED && command_names.size() == SIZE_COMMANDS, "sizes");
  auto references = controller.export_reference_interfaces();
  auto estimates = controller.export_state_interfaces();
  std::array<double, SIZE_MEASURED> measured{};
  std::array<double, SIZE_COMMANDS> commands{};
  bool state_locked = false, command_locked = false;
  const auto lent = [](const auto & names, auto & values, auto loan) { /* in the other order than asked for */
    for (std::size_t k = names.size(); k-- > 0;) {
      const auto at = names[k].find('/');
      loan(names[k].substr(0, at), names[k].substr(at + 1), &values[k]);
    }
  };
  const auto assign = [&](bool all) {
    std::vector<hardware_interface::LoanedStateInterface> states;
    std::vector<hardware_interface::LoanedCommandInterface> orders;
    lent(measured_names, measured, [&](auto joint, auto name, double * value) {
      states.emplace_back(hardware_interface::StateInterface(joint, name, value), &state_locked);
    });
    if (all) {
      lent(command_names, commands, [&](auto joint, auto name, double * value) {
        orders.emplace_back(hardware_interface::CommandInterface(joint, name, value), &command_locked);
      });
    }
    controller.assign_interfaces(std::move(orders), std::move(states));
  };
  assign(false);
  require(controller.on_activate(UNKNOWN) != CallbackReturn::SUCCESS, "a missing interface is refused");
  assign(true);
  require(controller.on_activate(UNKNOWN) == CallbackReturn::SUCCESS, "on_activate");
  require(controller.update({}, {}) == return_type::OK, "update without a controller before it");
  for (double command : commands) {
    require(command == 0.0, "no command without a controller before it");
  }
  require(controller.on_activate(UNKNOWN) == CallbackReturn::SUCCESS, "on_activate again");
  require(controller.set_chained_mode(true), "set_chained_mode");

  OWN(_parameters) constants = OWN_PARAMETERS;
  constants.cancellation_gain = 0.5;
  OWN(_prepare)(&constants);
  OWN(_state) state{};
  OWN(_outputs) out{};
  OWN(_inputs) in{};
  static_assert(sizeof in == (SIZE_MEASURED + SIZE_COMMANDS) * sizeof(double), "inputs: what is measured, then commands");
  std::array<double, SIZE_COMMANDS> sent{};
  unsigned seed = 1;
  int faults = 0, limited = 0;
  for (int k = 0; k < 2000; ++k) {
    for (std::size_t j = 0; j < SIZE_MEASURED; ++j) {
      measured[j] = 0.2 * std::sin(0.004 * k + j) + 1e-5 * noise(seed);
    }
    for (auto & reference : references) {
      *reference.value() = 20.0 * noise(seed);
    }
    state_locked = k % 100 == 50;
    command_locked = k % 100 == 70;
    if (k % 100 == 90) {
      *references[0].value() = NOTHING;
    }
    const long before = allocated;
    require(controller.update({}, {}) == return_type::OK, "update");
    require(allocated == before, "nothing allocated in update");

    std::array<double, SIZE_MEASURED + SIZE_COMMANDS> all{};
    for (std::size_t j = 0; j < SIZE_MEASURED; ++j) {
      all[j] = state_locked ? NOTHING : measured[j];
    }
    std::memcpy(&all[SIZE_MEASURED], sent.data(), sizeof sent);
    std::memcpy(&in, all.data(), sizeof in);
    if (k == 0) {
      OWN(_init)(&state, &constants, &in);
    }
    OWN(_state) trial = state;
    OWN(_outputs) ahead = out;
    OWN(_step)(&trial, &constants, &in, &ahead);
    const double cancelling[SIZE_COMMANDS] = CANCELLING;
    for (std::size_t j = 0; j < SIZE_COMMANDS; ++j) {
      const double reference = *references[j].value();
      double wanted = std::isnan(reference) ? 0.0 : reference + std::fmax(-LIMIT, std::fmin(LIMIT, cancelling[j]));
      limited += std::fabs(cancelling[j]) > LIMIT;
      sent[j] = command_locked ? sent[j] : wanted;
    }
    require(std::memcmp(sent.data(), commands.data(), sizeof sent) == 0, "the commands have the bits of the plain C");
    std::memcpy(&all[SIZE_MEASURED], sent.data(), sizeof sent);
    std::memcpy(&in, all.data(), sizeof in);
    OWN(_step)(&state, &constants, &in, &out);
    faults += out.fault;
    require(*estimates.back().value() == out.fault, "the fault is offered");
    require(*estimates.front().value() == out.FIRST_ESTIMATE, "the estimates are offered");
  }
  require(controller.on_deactivate(UNKNOWN) == CallbackReturn::SUCCESS, "on_deactivate");
  for (double command : commands) {
    require(command == 0.0, "no command after deactivation");
  }
  std::printf("same; faults %d, limited %d\n", faults, limited);
  return 0;
}
