// Flies the component for F Prime around recorded control steps: fly recorded.bin
#include "Controller.hpp"
#include "record.h"

#include <memory>

static recorded_step step;
static bool is_taken;
static Adcs::Actuation driven;

static bool hand_in(Adcs::Inputs& inputs) {
    const adcs_inputs& given = step.inputs;
    is_taken = true;
#include "inputs_to_component.inc"
    return true;
}

static bool hand_none(Adcs::Inputs&) {
    is_taken = true;
    return false;
}

static void keep(const Adcs::Actuation& actuation) { driven = actuation; }

static std::unique_ptr<Adcs::Controller> begun() {
    std::unique_ptr<Adcs::Controller> component(new Adcs::Controller("controller"));
    component->source = hand_in;
    component->sink = keep;
    return component;
}

static void run_to_step(Adcs::Controller& component) {
    for (is_taken = false; !is_taken;) {
        component.tick();
    }
}

static bool is_flown_the_same(Adcs::Controller& component) {
    auto& channels = component.sent.channels;
    run_to_step(component);
    return are_same(channels["Dipole"].data(), step.command, 3) &&
        are_same(channels["Torque"].data(), step.command + 3, 3) &&
        are_same(channels["Attitude"].data(), step.estimate, 4) &&
        are_same(channels["Rate"].data(), step.estimate + 4, 3) &&
        are_same(driven.get_torque_n_m().elements, step.command + 3, 3);
}

// Whether a step without inputs commands nothing and says so, and commands are confirmed.
static bool does_answer() {
    const double none[3] = {0.0, 0.0, 0.0};
    auto component = begun();
    component->source = hand_none;
    run_to_step(*component);
    bool good = are_same(driven.get_dipole_a_m2().elements, none, 3) &&
        component->sent.events.at(0) == "InputsMissing";
    component->send_REBASE(static_cast<double>(NAN));
    good = good && component->sent.responses.back() == Fw::CmdResponse::VALIDATION_ERROR &&
        component->sent.events.back() == "CommandRefused";
    component->send_RESTART_ESTIMATORS();
    good = good && component->sent.responses.back() == Fw::CmdResponse::OK;
    component->send_CLEAR_EVENT_THROTTLE();
    good = good && component->sent.cleared.size() > 2;
#include "sets_parameter.inc"
    return good;
}

int main(int count, char** arguments) {
    uint64_t steps = 0;
    uint64_t same = 0;
    FILE* file = opened_record(count > 1 ? arguments[1] : "", &steps);
    if (file == nullptr) {
        return 2;
    }
    auto component = begun();
    while (same < steps && is_step_read(file, &step)) {
        if (step.anew > 0.0) {
            component = begun();
        }
        if (!is_flown_the_same(*component)) {
            break;
        }
        same++;
    }
    (void)fclose(file);
    if (!does_answer()) {
        printf("a command or a missing input was answered otherwise\n");
        return 1;
    }
    return said(same, steps);
}
