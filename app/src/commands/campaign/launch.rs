//! Job files of schedulers that exist: Slurm, HyperQueue, Kubernetes, and xargs on one machine. A
//! task is `intrados campaign run DIR --part I/N`; that it may be started again, killed or run
//! twice is the units' business.

use std::{fmt::Write, path::PathBuf};

use super::{folder::Folder, plan::Plan};
use crate::failure::Failure;

/// Who runs the tasks.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Engine {
    Slurm,
    HyperQueue,
    Kubernetes,
    /// So many processes of this machine.
    Local(u16),
}

/// What is asked for.
#[derive(Debug, Clone)]
pub(crate) struct Wish {
    pub(crate) engine: Engine,
    pub(crate) tasks: Option<u64>,
    pub(crate) cores: u16,
    pub(crate) image: String,
    pub(crate) claim: String,
}

/// Files by their names, the one that submits the others last.
#[derive(Debug)]
pub(crate) struct JobFiles {
    /// Folder within the campaign's.
    pub(crate) folder: &'static str,
    pub(crate) files: Vec<(&'static str, String)>,
}

/// Most tasks if nobody says how many: Slurm's own limit of an array is 1001.
const TASKS: u64 = 1000;

/// How many times a task is started again that was killed.
const KILLS: u32 = 20;

/// What the files name.
struct Names {
    program: String,
    dir: String,
    tasks: u64,
}

/// The job files of a campaign.
pub(crate) fn job_files(folder: &Folder, plan: &Plan, wish: &Wish) -> Result<JobFiles, Failure> {
    let units = plan.units.len() as u64;
    let dir =
        std::path::absolute(folder.path()).map_err(|e| Failure::no_input(folder.path(), &e))?;
    let program = std::env::current_exe()
        .map_err(|e| Failure::Internal(format!("cannot tell where this program is: {e}")))?;
    let names = Names {
        program: text(program)?,
        dir: text(dir)?,
        tasks: wish.tasks.unwrap_or(TASKS).min(units),
    };
    Ok(match wish.engine {
        Engine::Slurm => slurm(&names, wish),
        Engine::HyperQueue => hyperqueue(&names, wish),
        Engine::Kubernetes => kubernetes(&names, wish, plan)?,
        Engine::Local(processes) => local(&names, wish, processes),
    })
}

fn text(path: PathBuf) -> Result<String, Failure> {
    let text = path.to_str().filter(|t| !t.chars().any(char::is_control));
    text.map(str::to_owned).ok_or_else(|| {
        Failure::BadInput(format!(
            "{}: a path that no job file can hold: rename it",
            path.display()
        ))
    })
}

/// A word for a shell.
fn quoted(word: &str) -> String {
    let plain = |c: char| c.is_ascii_alphanumeric() || "-_./=,:+@%".contains(c);
    if !word.is_empty() && word.chars().all(plain) {
        word.to_owned()
    } else {
        format!("'{}'", word.replace('\'', r"'\''"))
    }
}

/// A word for TOML and YAML: both read JSON's strings.
fn string(word: &str) -> Result<String, Failure> {
    serde_json::to_string(word).map_err(|e| Failure::Internal(e.to_string()))
}

/// A script that does one task. A task that is to go on is started again, and one that was killed,
/// so many times: what has no memory left would be killed for ever.
fn task(names: &Names, wish: &Wish, number: &str) -> String {
    let (program, dir) = (quoted(&names.program), quoted(&names.dir));
    let (tasks, cores) = (names.tasks, wish.cores);
    format!(
        r#"#!/bin/sh
killed=0
while :; do
  {program} campaign run {dir} --part "{number}/{tasks}" --threads {cores} --quiet
  code=$?
  [ "$code" -gt 128 ] && killed=$((killed + 1))
  [ "$code" = 75 ] || {{ [ "$code" -gt 128 ] && [ "$killed" -le {KILLS} ]; }} || exit "$code"
  [ "$code" = 75 ] && sleep 1
done
"#
    )
}

fn slurm(names: &Names, wish: &Wish) -> JobFiles {
    let (program, dir) = (quoted(&names.program), quoted(&names.dir));
    let last = names.tasks - 1;
    let (tasks, cores) = (names.tasks, wish.cores);
    let array = format!(
        r#"#!/bin/sh
#SBATCH --job-name=intrados
#SBATCH --array=0-{last}
#SBATCH --cpus-per-task={cores}
#SBATCH --requeue
#SBATCH --open-mode=append
#SBATCH --signal=B:TERM@60
# A minute before its time is over a task is asked to stop: it keeps its checkpoint, ends with 75 and is queued again.
trap 'kill -TERM "$run"' TERM
{program} campaign run {dir} --part "$SLURM_ARRAY_TASK_ID/{tasks}" --threads {cores} --quiet &
run=$!
wait "$run"; code=$?
# A trap ends the first wait; the second one is for the program.
while kill -0 "$run" 2>/dev/null; do wait "$run"; code=$?; done
if [ "$code" = 75 ] || {{ [ "$code" -gt 128 ] && [ "${{SLURM_RESTART_COUNT:-0}}" -le {KILLS} ]; }}; then
  scontrol requeue "${{SLURM_ARRAY_JOB_ID}}_$SLURM_ARRAY_TASK_ID"
fi
exit "$code"
"#
    );
    let collect = format!(
        "#!/bin/sh\n#SBATCH --job-name=intrados-collect\n#SBATCH --open-mode=append\nexec {program} campaign collect {dir}\n"
    );
    // afterany: where tasks failed, collecting says which units are missing.
    let submit = format!(
        "#!/bin/sh\nset -e\ncd {dir}/launch/slurm\njob=$(sbatch --parsable array.sh)\nsbatch --dependency=afterany:\"${{job%%;*}}\" collect.sh\n"
    );
    JobFiles {
        folder: "slurm",
        files: vec![("array.sh", array), ("collect.sh", collect), ("submit.sh", submit)],
    }
}

fn hyperqueue(names: &Names, wish: &Wish) -> JobFiles {
    let (program, dir) = (quoted(&names.program), quoted(&names.dir));
    let (tasks, cores) = (names.tasks, wish.cores);
    let mut job = format!("name = \"intrados\"\nmax_fails = {tasks}\n");
    for id in 0..tasks {
        // Lost workers are no fault of the task.
        _ = write!(
            job,
            "\n[[task]]\nid = {id}\ncommand = [\"sh\", \"task.sh\"]\ncrash_limit = 1000\n[[task.request]]\nresources = {{ \"cpus\" = \"{cores}\" }}\n"
        );
    }
    // Where a task failed HyperQueue cancels what rests on it: then collecting is the user's, who
    // is told so.
    let all: Vec<String> = (0..tasks).map(|id| id.to_string()).collect();
    _ = write!(
        job,
        "\n[[task]]\nid = {tasks}\ncommand = [\"sh\", \"collect.sh\"]\ncrash_limit = 1000\ndeps = [{}]\n",
        all.join(", ")
    );
    let collect = format!("#!/bin/sh\nexec {program} campaign collect {dir}\n");
    let submit = format!(
        "#!/bin/sh\nset -e\ncd {dir}/launch/hyperqueue\nhq job submit-file job.toml\n# Where tasks failed, the last one does not collect: {program} campaign status {dir}\n"
    );
    let task = task(names, wish, "$HQ_TASK_ID");
    JobFiles {
        folder: "hyperqueue",
        files: vec![
            ("task.sh", task),
            ("collect.sh", collect),
            ("job.toml", job),
            ("submit.sh", submit),
        ],
    }
}

fn kubernetes(names: &Names, wish: &Wish, plan: &Plan) -> Result<JobFiles, Failure> {
    let (dir, image, claim) = (string(&names.dir)?, string(&wish.image)?, string(&wish.claim)?);
    let mount = string(&text(common(&names.dir, plan)?)?)?;
    // A name of its own for every plan, so that the same one is not begun twice.
    let name: String = plan.units.first().map_or("", |u| &u.id).chars().take(10).collect();
    let (tasks, cores) = (names.tasks, wish.cores);
    let parallel = tasks.min(1000);
    // 75 is no failure: it is started again. What is wrong with the input stays wrong.
    let job = format!(
        r#"apiVersion: batch/v1
kind: Job
metadata:
  name: intrados-{name}
spec:
  completionMode: Indexed
  completions: {tasks}
  parallelism: {parallel}
  backoffLimitPerIndex: 10
  podReplacementPolicy: Failed
  podFailurePolicy:
    rules:
      - action: Ignore
        onPodConditions:
          - type: DisruptionTarget
            status: "True"
      - action: Ignore
        onExitCodes:
          containerName: intrados
          operator: In
          values: [75]
      - action: FailIndex
        onExitCodes:
          containerName: intrados
          operator: In
          values: [2, 65, 66]
  template:
    spec:
      restartPolicy: Never
      terminationGracePeriodSeconds: 60
      containers:
        - name: intrados
          image: {image}
          command: ["intrados"]
          args: ["campaign", "run", {dir}, "--part", "$(JOB_COMPLETION_INDEX)/{tasks}", "--threads", "{cores}", "--quiet"]
          env:
            - name: JOB_COMPLETION_INDEX
              valueFrom:
                fieldRef:
                  fieldPath: metadata.annotations['batch.kubernetes.io/job-completion-index']
          resources:
            requests:
              cpu: "{cores}"
              memory: 1Gi
          volumeMounts:
            - name: campaign
              mountPath: {mount}
      volumes:
        - name: campaign
          persistentVolumeClaim:
            claimName: {claim}
"#
    );
    // An Indexed Job has no last step of its own.
    let shown = quoted(&names.dir);
    let submit = format!(
        "#!/bin/sh\nset -e\ncd {shown}/launch/kubernetes\nkubectl apply -f job.yaml\n# Once it is done (kubectl wait --for=condition=complete --timeout=-1s job/intrados-{name}), where its volume is mounted: intrados campaign collect {shown}\n"
    );
    Ok(JobFiles { folder: "kubernetes", files: vec![("job.yaml", job), ("submit.sh", submit)] })
}

/// The deepest folder that holds the campaign and the files of its structures.
fn common(dir: &str, plan: &Plan) -> Result<PathBuf, Failure> {
    let files = plan.structures.iter().map(|s| s.path.as_path()).filter(|p| p.is_absolute());
    let mut common = PathBuf::from(dir);
    for file in files {
        while !file.starts_with(&common) {
            common.pop();
        }
    }
    if common.parent().is_none() {
        return Err(Failure::Usage(
            "the campaign and its structures share no folder that could be mounted: put them into one"
                .into(),
        ));
    }
    Ok(common)
}

fn local(names: &Names, wish: &Wish, processes: u16) -> JobFiles {
    let (program, dir) = (quoted(&names.program), quoted(&names.dir));
    let last = names.tasks - 1;
    // xargs goes on after failures; units that failed are in `status`, and collecting names them.
    let submit = format!(
        "#!/bin/sh\ncd {dir}/launch/local || exit\nseq 0 {last} | xargs -P {processes} -n 1 sh task.sh\nexec {program} campaign collect {dir}\n"
    );
    let task = task(names, wish, "$1");
    JobFiles { folder: "local", files: vec![("task.sh", task), ("submit.sh", submit)] }
}
