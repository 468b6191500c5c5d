// What the server says to the console; docs/reference/console.md describes it.
import { ObjectPose, ToClick } from './corners'
import { Known, RigFacts } from './state'

export interface Field {
  key: string
  label: string
  kind: 'text' | 'number' | 'choice' | 'word' | 'folder'
  choices: string[]
  help: string
  required: boolean
  number?: { least: number | null; most: number | null; whole: boolean; expected: string }
}
export interface Form {
  name: string
  title: string
  what: string
  hold: boolean
  moves: boolean
  role: string // the least that may start it
  granted: boolean
  fields: Field[]
}
interface Rig extends RigFacts {
  description: string
  version: string
  click: ToClick | null
}
export interface RigChoice {
  chosen: string // its name
  rig: Rig
  forms: Form[]
}
export interface Hello extends RigChoice {
  is: 'hello'
  page: string
  you: number
  user: string
  role: 'watch' | 'operate' | 'administer'
  rigs: string[] // that may be chosen
}
export interface Run {
  is: 'run'
  command: string
  title: string
  words: string[]
  moves: boolean
  hold: boolean
  stopping: boolean
  began_utc: string
  exit_code: number | null
}
export interface ScoreOf {
  method: string
  mean_error_m: number | null
  coverage: number | null
  coverage_of_ceiling: number | null
  outliers: number | null
}
export interface Feed {
  is: 'feed'
  feed: string
  utc: string
  [key: string]: unknown
}
export type Message =
  | Hello
  | Run
  | Feed
  | { is: 'control'; holder: number | null; holder_name: string; offered: boolean; browsers: number }
  | { is: 'log'; text: string }
  | { is: 'refused'; why: string }
  | { is: 'granted'; wish: string; answer: { file: string } }
  | { is: 'answered'; wish: string; answer: ObjectPose }
  | { is: 'alive'; utc: string }
  | ({ is: 'rig' } & RigChoice)
  | ({ is: 'known' } & Known)
  | { is: 'disk'; utc: string; free_bytes?: number; bytes?: number }
