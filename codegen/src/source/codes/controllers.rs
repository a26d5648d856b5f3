//! Codes of controllers.

codes! {
    BAD_SAMPLE "bad-sample"
        "The time between the samples of a controller is not positive."
        "Give a positive time, as in `sample: 5 ms`.";
    BAD_DELAY "bad-delay"
        "The delay of a controller is negative or longer than the time between its samples."
        "Give a delay from 0 to the time between samples; `1 sample` is the longest.";
    BAD_PWM "bad-pwm"
        "The period, the levels or the duty of a controller's pulse-width modulation contradict each other or the \
         time between samples."
        "Give a period that fits a whole number of times between two samples, two ascending levels, and an ascending \
         duty between 0 and 1.";
    SECOND_CONTROLLER "second-controller"
        "Two controllers drive the same input."
        "Let one controller drive the input.";
    IDLE_CONTROLLER "idle-controller"
        "A controller drives no input."
        "Name an input and its formula under `inputs`, or remove the controller.";
    UNKNOWN_INPUT "unknown-input"
        "A controller drives an input that the model does not have."
        "Declare the input under `inputs` of the model, or correct its name.";
}
